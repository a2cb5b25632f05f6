"""How a study stands, as one record that a page shows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from core.montecarlo.settings import StudySettings
from core.resumable.journal import Record
from flexgui.session.study_shown import ShownSection

IDLE, RUNNING, STOPPING = "idle", "running", "stopping"
STOPPED, DONE, FAILED = "stopped", "done", "failed"


@dataclass(frozen=True)
class StudyState:
    """One study of the session."""

    phase: str = IDLE
    settings: StudySettings | None = None
    """What is studied; None: nothing yet."""
    parts: tuple[str, ...] = ()
    done: int = 0
    total: int = 0
    before: int = 0
    """Of `done`, what was known when it began."""
    remaining_seconds: float | None = None
    """None where nobody knows."""
    sentence: str = ""
    """Why it failed."""
    sections: tuple[ShownSection, ...] = ()
    """What has been drawn of its results; a moment behind `done`."""

    @property
    def busy(self) -> bool:
        """Whether the study runs or is being stopped."""
        return self.phase in (RUNNING, STOPPING)

    @property
    def share(self) -> float:
        """Of the cases that are done, 0 to 1."""
        return self.done / self.total if self.total else 0.0


def remaining(
    known: Mapping[str, Record], new: Iterable[str], left: Iterable[str], elapsed: float
) -> float | None:
    """s for the cases `left`, named by their parts, at the pace at which the cases with the keys
    `new` were done in `elapsed` s; None without a pace.

    The parts differ by a factor of a hundred, so each is expected to go on as it has begun.
    """
    work = sum(known[key]["seconds"] for key in new)
    if not work or elapsed <= 0.0:
        return None
    each: dict[str, list[float]] = defaultdict(list)
    for record in known.values():
        each[record["part"]].append(record["seconds"])
    mean = {part: sum(values) / len(values) for part, values in each.items()}
    usual = sum(mean.values()) / len(mean)
    return sum(mean.get(part, usual) for part in left) * elapsed / work
