"""The report of a study, in a worker."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flexgui.core.montecarlo.settings import StudySettings, settings_of
from flexgui.core.resumable.journal import Journal

if TYPE_CHECKING:
    from flexgui.core.montecarlo.summary import Summary
    from flexgui.core.progress import Progress

JOURNAL = "results.jsonl"
"""Beside the report, as `flexgui study` has it: that command goes on in the same folder."""


def study_report(settings: str, folder: str, *, progress: Progress) -> str:
    """`write_report` in a worker; `settings` as JSON."""
    progress.stage("Writing the report of the study")
    write_report(settings_of(settings), Path(folder))
    return folder


def write_report(settings: StudySettings, folder: Path) -> Summary | None:
    """Page, tables and result of all that the journal in `folder` holds; None where it is empty."""
    from flexgui.core.montecarlo.summary import summarise
    from flexgui.stages.study.report import write_study

    records = Journal(folder / JOURNAL, settings.identity).records
    summary = summarise(settings, records) if records else None
    if summary is not None:
        write_study(summary, folder)
    return summary
