"""Write the report of an outcome."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.progress import Progress
    from core.results import Outcome


def export(outcome: Outcome, scenario_toml: str, out: str, *, progress: Progress) -> str:
    """The folder `out`, with the report of what the page shows: nothing is computed again."""
    from flexgui.export import check_writable, export_outcome

    progress.stage("Writing the report")
    folder = Path(out)
    check_writable(folder)
    export_outcome(outcome, scenario_toml, folder)
    return str(folder)
