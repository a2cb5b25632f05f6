"""What a job is asked to do, and what it reports: tasks and orders one way, events the other; and
within which limits."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flexgui.core.results import Generation


@dataclass(frozen=True)
class Event:
    """One thing that happened to a job."""


@dataclass(frozen=True)
class Queued(Event):
    """The job waits; told again when its place changes."""

    place: int
    """1 is next."""


@dataclass(frozen=True)
class Started(Event):
    """A worker has the job."""


@dataclass(frozen=True)
class Paused(Event):
    """The job waits for `resume`, its worker with it."""


@dataclass(frozen=True)
class Resumed(Event):
    """The job goes on."""


@dataclass(frozen=True)
class Stopping(Event):
    """The job was asked to end with the best it has."""


@dataclass(frozen=True)
class Stage(Event):
    """A new stage begins, with `total` steps where that is known."""

    title: str
    total: int | None = None


@dataclass(frozen=True)
class Advanced(Event):
    """`n` more steps of the stage are done."""

    n: int = 1
    text: str = ""


@dataclass(frozen=True)
class NewGeneration(Event):
    """The newest generation of the fit `label`; numbers may be missing in between, the last of a
    search never is, and the finished fit's `convergence` has them all."""

    label: str
    generation: Generation


@dataclass(frozen=True)
class Partial(Event):
    """What the task has so far; a newer one of the same name stands for all earlier ones."""

    name: str
    value: Any


@dataclass(frozen=True)
class Ended(Event):
    """The job's last event."""


@dataclass(frozen=True)
class Finished(Ended):
    """The task is done."""

    result: Any


@dataclass(frozen=True)
class Failed(Ended):
    """The task cannot be done; the sentence is for the user."""

    sentence: str
    traceback: str = ""
    """For the log, where a worker met what nobody expected; its sentence is the error then."""


@dataclass(frozen=True)
class Stopped(Ended):
    """The user stopped it."""

    result: Any = None
    """The best the task had; None where it had nothing yet or did not answer in time."""


@dataclass(frozen=True)
class WorkerLost(Ended):
    """The worker process died."""

    sentence: str


def merged(waiting: list[Event], event: Event) -> list[Event]:
    """With one more event: it stands for a waiting one of the same subject, but never across one
    that has no subject (a new stage, an end). So the order of what matters stays, and what waits is
    short however slow the reader is."""
    subject = _subject(event)
    for place in reversed(range(len(waiting)) if subject is not None else ()):
        earlier = waiting[place]
        if _subject(earlier) is None:
            break
        if _subject(earlier) == subject:
            return [*waiting[:place], _together(earlier, event), *waiting[place + 1 :]]
    return [*waiting, event]


def _subject(event: Event) -> tuple[type[Event], str] | None:
    """Events of one subject may be told as one; None where each counts."""
    match event:
        case Queued() | Advanced():
            return type(event), ""
        case NewGeneration(name) | Partial(name):
            return type(event), name
    return None


def _together(earlier: Event, event: Event) -> Event:
    """What is told of two events of one subject."""
    if isinstance(earlier, Advanced) and isinstance(event, Advanced):
        return Advanced(earlier.n + event.n, event.text or earlier.text)
    return event


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
    """What the server tells a worker besides its next task."""

    STOP = "stop"
    PAUSE = "pause"
    RESUME = "resume"
    EXIT = "exit"


ALIVE = None
"""Told again and again, whatever a worker does: who is silent hangs."""


@dataclass(frozen=True)
class Ready:
    """The worker is warm, or at least there."""

    trouble: str = ""
    """Traceback of a warm-up that failed: the jobs will say themselves what is wrong."""


@dataclass(frozen=True)
class PoolSettings:
    """Limits and times of a pool."""

    queued_per_session: int = 4
    """Jobs of one session that may wait."""
    grace: float = 8.0
    """s that a task may take to end by itself once it was stopped; then its worker is killed."""
    silence: float = 60.0
    """s without a sign of life, of which there is one every two, after which a worker hangs: one
    large function that is compiled has held up a busy machine's interpreter for fifteen."""
    pause_limit: float = 600.0
    """s that a paused job may keep its worker while others wait; then it is stopped."""
    recycle_after: int = 200
    """Jobs, after which a worker is replaced: whatever memory it gathered is given back."""
    calm: float = 6.0
    """s after a worker's or a job's start in which no further worker is started that nobody waits
    for: it would take the cores from the first ranking of whoever clicks at once."""
    start_limit: float = 300.0
    """s that a worker may need to be ready; on a new machine everything is compiled first."""
    niceness: int = 10
    """Of the workers, so that the page answers first (POSIX)."""
    memory: int | None = 3_000_000_000
    """Bytes that a job may take beyond what its warm worker has (Linux); None: all there are. The
    diagnosis of seven recordings takes a tenth of that; two such jobs still fit into a laptop."""
    seconds: float | None = None
    """That a job may take, in all and of a processor; then its worker is replaced. None: no end."""
    warm_up: str | None = "flexgui.jobs.worker:warm_up"
    """What a worker calls before its first job, as "package.module:name"."""


DEFAULT = PoolSettings()
