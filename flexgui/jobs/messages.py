"""Messages between server and workers: tasks and orders to a worker, events from it; and the
settings of a pool."""

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
    """The job waits; sent again when its place changes."""

    place: int
    """1 is next; 0: nobody is before it, its worker is being started."""


@dataclass(frozen=True)
class Started(Event):
    """A worker has the job."""


@dataclass(frozen=True)
class Paused(Event):
    """The job and its worker wait for `resume`."""


@dataclass(frozen=True)
class Resumed(Event):
    """The job goes on."""


@dataclass(frozen=True)
class Stopping(Event):
    """The job was asked to end with its best result so far."""


@dataclass(frozen=True)
class Stage(Event):
    """A new stage begins, with `total` steps where that is known."""

    title: str
    total: int | None = None


@dataclass(frozen=True)
class Advanced(Event):
    """`n` more steps of the stage are done, and so many simulations."""

    n: int = 1
    text: str = ""
    simulations: int = 0


@dataclass(frozen=True)
class NewGeneration(Event):
    """The newest generation of the fit `label`; numbers may be missing in between, the last of a
    search never is, and the finished fit's `convergence` has them all."""

    label: str
    generation: Generation


@dataclass(frozen=True)
class Partial(Event):
    """A partial result; a newer one of the same name replaces all earlier ones."""

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
    """For the log, after an unexpected error; the sentence is that error then."""


@dataclass(frozen=True)
class Stopped(Ended):
    """The user stopped it."""

    result: Any = None
    """The best result so far; None without one or without an answer in time."""


@dataclass(frozen=True)
class WorkerLost(Ended):
    """The worker process died."""

    sentence: str


def merge_events(waiting: list[Event], event: Event) -> list[Event]:
    """The waiting events with one more: it replaces a waiting event of the same subject, but never
    across an event without a subject (a new stage, an end). So the order is kept, and the list
    stays short for a slow reader."""
    subject = _subject(event)
    for place in reversed(range(len(waiting)) if subject is not None else ()):
        earlier = waiting[place]
        if _subject(earlier) is None:
            break
        if _subject(earlier) == subject:
            return [*waiting[:place], _merged_pair(earlier, event), *waiting[place + 1 :]]
    return [*waiting, event]


def _subject(event: Event) -> tuple[type[Event], str] | None:
    """Events of one subject can be merged into one; None where each counts."""
    match event:
        case Queued() | Advanced():
            return type(event), ""
        case NewGeneration(name) | Partial(name):
            return type(event), name
    return None


def _merged_pair(earlier: Event, event: Event) -> Event:
    """One event for two of the same subject."""
    if isinstance(earlier, Advanced) and isinstance(event, Advanced):
        simulations = earlier.simulations + event.simulations
        return Advanced(earlier.n + event.n, event.text or earlier.text, simulations)
    return event


@dataclass(frozen=True)
class Task:
    """`function` is "package.module:name"; it takes the arguments and a `progress`."""

    function: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    """Arguments and result are sent through a pipe: records, arrays, texts, numbers."""
    title: str = "The work"
    """How a sentence about the task begins."""

    @staticmethod
    def of(function: Callable[..., Any], title: str = "The work", **arguments: Any) -> Task:
        """A task of a function; TypeError at once if the arguments do not fit."""
        inspect.signature(function).bind(progress=None, **arguments)
        return Task(Task.name(function), arguments, title)

    @staticmethod
    def name(function: Callable[..., Any]) -> str:
        """The name by which a worker imports a function."""
        return f"{function.__module__}:{function.__qualname__}"

    def resolve(self) -> Callable[..., Any]:
        """The function, imported."""
        module, _, name = self.function.partition(":")
        function = getattr(importlib.import_module(module), name)
        assert callable(function), f"{self.function} is not a function"
        return function


class Order(Enum):
    """What the server sends to a worker besides tasks."""

    STOP = "stop"
    PAUSE = "pause"
    RESUME = "resume"
    EXIT = "exit"


ALIVE = None
"""Sent repeatedly by every worker: a silent worker hangs."""


@dataclass(frozen=True)
class Ready:
    """The worker has started and warmed up."""

    warm_up_error: str = ""
    """Traceback of a failed warm-up; the first job reports the error itself."""


@dataclass(frozen=True)
class PoolSettings:
    """Limits and times of a pool."""

    queued_per_session: int = 4
    """Jobs of one session that may wait."""
    grace: float = 8.0
    """s that a task may take to end by itself once it was stopped; then its worker is killed."""
    silence: float = 60.0
    """s without a heartbeat (sent every 2 s) after which a worker counts as hanging: compiling one
    large function has blocked a busy machine's interpreter for 15 s."""
    pause_limit: float = 600.0
    """s that a paused job may keep its worker while others wait; then it is stopped."""
    recycle_after: int = 200
    """Jobs after which a worker is replaced, to free its memory."""
    kept: int = 1
    """Workers that are always warm; others start for a waiting job."""
    idle_limit: float = 120.0
    """s without a job after which a worker beyond those ends: it holds half a gigabyte."""
    start_limit: float = 300.0
    """s that a worker may need to be ready; on a new machine everything is compiled first."""
    niceness: int = 10
    """Of the workers, so that the page answers first (POSIX)."""
    memory: int | None = 3_000_000_000
    """Bytes that a job may take beyond those of its warm worker (Linux); None: no limit. The
    diagnosis of seven recordings takes a tenth of that; two such jobs still fit into a laptop."""
    seconds: float | None = None
    """s that a job may take, by the clock and of a processor; then its worker is replaced. None: no
    limit."""
    warm_up: str | None = "flexgui.jobs.worker:warm_up"
    """What a worker calls before its first job, as "package.module:name"."""


DEFAULT = PoolSettings()
