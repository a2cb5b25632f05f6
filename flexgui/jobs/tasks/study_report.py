"""Write the report of what a study has found so far."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.progress import Progress

JOURNAL = "results.jsonl"
"""Beside the report, as `flexgui study` has it: that command goes on in the same folder."""


def study_report(settings: str, folder: str, *, progress: Progress) -> str:
    """Page, tables and result into `folder`, from the journal in it; `settings` as JSON."""
    from core.montecarlo.settings import settings_of
    from core.montecarlo.summary import summarise
    from core.resumable.journal import Journal
    from flexgui.export.study_report import write_study

    progress.stage("Writing the report of the study")
    known, out = settings_of(settings), Path(folder)
    write_study(summarise(known, Journal(out / JOURNAL, known.identity).records), out)
    return folder
