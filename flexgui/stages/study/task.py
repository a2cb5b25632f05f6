"""The cases and the report of a study, in a worker."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flexgui.jobs.task import Task

if TYPE_CHECKING:
    from flexgui.core.progress import Progress


JOURNAL = "results.jsonl"
"""Beside the report, as `flexgui study` has it: that command goes on in the same folder."""


def study_case(work: str, order: str, *, progress: Progress) -> str:
    """The record of the case that `order` states, both as text; `work` names who makes it."""
    found = Task(work).resolve()(order)
    assert isinstance(found, str)
    return found


def study_report(settings: str, folder: str, *, progress: Progress) -> str:
    """Page, tables and result into `folder`, from the journal in it; `settings` as JSON."""
    from flexgui.core.montecarlo.settings import settings_of
    from flexgui.core.montecarlo.summary import summarise
    from flexgui.core.resumable.journal import Journal
    from flexgui.stages.study.report import write_study

    progress.stage("Writing the report of the study")
    known, out = settings_of(settings), Path(folder)
    write_study(summarise(known, Journal(out / JOURNAL, known.identity).records), out)
    return folder
