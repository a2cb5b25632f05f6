"""Write the report of an outcome."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.progress import Progress
    from core.results import Outcome


def export(
    outcome: Outcome, scenario_toml: str, folder: str, out: str, *, progress: Progress
) -> str:
    """The folder `out`, with the report of what the page shows: nothing is identified again.

    `folder` holds the files that the scenario may read; its first motion is played in the report.
    """
    from core.scenario.data_folder import Within
    from core.scenario.read import parse_scenario
    from flexgui.export.diagnosed_file import diagnosed_plainly
    from flexgui.export.folder import check_writable
    from flexgui.export.motion import report_motion
    from flexgui.export.outcome import export_outcome

    progress.stage("Writing the report")
    check_writable(Path(out))
    scenario = parse_scenario(scenario_toml, "scenario.toml")
    motion = report_motion(scenario, outcome, Within(Path(folder)))
    found = diagnosed_plainly(scenario, outcome)
    export_outcome(outcome, scenario_toml, Path(out), motion, found)
    return out
