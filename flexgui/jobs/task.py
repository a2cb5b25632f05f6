"""A task, which function a worker calls and with what, and the messages about it through the
pipe."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any


@dataclass(frozen=True)
class Task:
    """`function` is "package.module:name"; it takes the arguments and a `progress`."""

    function: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    """They and the result travel through a pipe: records, arrays, texts, numbers."""
    title: str = "The work"
    """How a sentence about the task begins."""

    @staticmethod
    def of(function: Callable[..., Any], title: str = "The work", **arguments: Any) -> Task:
        """From the function itself; TypeError at once where the arguments do not suit it."""
        inspect.signature(function).bind(progress=None, **arguments)
        return Task(Task.name(function), arguments, title)

    @staticmethod
    def name(function: Callable[..., Any]) -> str:
        """By which a worker finds a function."""
        return f"{function.__module__}:{function.__qualname__}"

    def resolve(self) -> Callable[..., Any]:
        """The function, imported."""
        module, _, name = self.function.partition(":")
        found = getattr(importlib.import_module(module), name)
        assert callable(found), f"{self.function} is not a function"
        return found


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
