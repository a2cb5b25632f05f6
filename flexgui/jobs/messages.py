"""What travels through the pipe besides events: orders to a worker and its answers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

from flexgui.jobs.task import Task


class Order(Enum):
    """What the server tells a worker while it works."""

    STOP = "stop"
    PAUSE = "pause"
    RESUME = "resume"
    EXIT = "exit"


@dataclass(frozen=True)
class Begin:
    """Do this."""

    task: Task


@dataclass(frozen=True)
class Alive:
    """Told again and again, whatever the worker does: who is silent hangs."""


@dataclass(frozen=True)
class Ready:
    """The worker is warm, or at least there."""

    trouble: str = ""
    """Traceback of a warm-up that failed: the jobs will say themselves what is wrong."""


@dataclass(frozen=True)
class Done:
    """The task returned."""

    result: Any
    stopped: bool
    """Whether it was told to stop while it ran, so that the result is the best so far."""


@dataclass(frozen=True)
class Refused:
    """The task raised InputError."""

    sentence: str


@dataclass(frozen=True)
class Crashed:
    """The task raised something else."""

    error: str
    """Type and text, one line."""
    traceback: str


Answer = Done | Refused | Crashed
"""The one message that ends a task."""
