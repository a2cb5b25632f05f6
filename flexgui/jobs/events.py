"""What a job reports to its callback."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flexgui.core.results import Generation


@dataclass(frozen=True)
class Event:
    """One thing that happened to a job."""

    @property
    def subject(self) -> Hashable | None:
        """Events of one subject may be told as one; None where each counts."""
        return None

    def after(self, earlier: Any) -> Event:
        """The one event that stands for an earlier one of the same subject and this one."""
        return self


@dataclass(frozen=True)
class Queued(Event):
    """The job waits; told again when its place changes."""

    place: int
    """1 is next."""

    @property
    def subject(self) -> Hashable:
        return "place"


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

    @property
    def subject(self) -> Hashable:
        return "advance"

    def after(self, earlier: Any) -> Advanced:
        return Advanced(earlier.n + self.n, self.text or earlier.text)


@dataclass(frozen=True)
class NewGeneration(Event):
    """The newest generation of the fit `label`; numbers may be missing in between, the last of a
    search never is, and the finished fit's `convergence` has them all."""

    label: str
    generation: Generation

    @property
    def subject(self) -> Hashable:
        return ("generation", self.label)


@dataclass(frozen=True)
class Partial(Event):
    """What the task has so far; a newer one of the same name stands for all earlier ones."""

    name: str
    value: Any

    @property
    def subject(self) -> Hashable:
        return ("partial", self.name)


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
    for place in reversed(range(len(waiting)) if event.subject is not None else ()):
        subject = waiting[place].subject
        if subject is None:
            break
        if subject == event.subject:
            return [*waiting[:place], event.after(waiting[place]), *waiting[place + 1 :]]
    return [*waiting, event]
