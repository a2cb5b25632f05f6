"""One case of a Monte Carlo study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexgui.jobs.task import Task

if TYPE_CHECKING:
    from core.progress import Progress


def study_case(work: str, order: str, *, progress: Progress) -> str:
    """The record of the case that `order` states, both as text; `work` names who makes it."""
    found = Task(work).resolve()(order)
    assert isinstance(found, str)
    return found
