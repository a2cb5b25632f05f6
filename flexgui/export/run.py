"""From a scenario file to an export, without a page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from core.errors import InputError
from core.progress import Progress
from flexgui.export.folder import check_writable


def export_scenario(
    path: Path, out: Path, data: Path | None, progress: Progress, say: Callable[[str], None]
) -> None:
    """Read, run, export; bad input is found before anything long begins.

    `say` hears which files lie outside the scenario's folder and the data folder.
    """
    from core.scenario.data_folder import outside
    from core.scenario.read import read_scenario

    if data is not None and not data.is_dir():
        raise InputError(f"--data {data} is no folder; name the one that holds the recordings.")
    scenario = read_scenario(path)
    text = path.read_text(encoding="utf-8-sig")
    check_writable(out)
    if far := outside(scenario, path.parent, data):
        say(far)

    from core.scenario.stated_effects import arms_to_come
    from core.warm import warm_up

    warm_up(progress, arms_to_come(scenario))

    from core.workbench import run_scenario

    outcome = run_scenario(scenario, folder=path.parent, data_folder=data, progress=progress)

    from flexgui.export.diagnosed_file import diagnosed_beside
    from flexgui.export.motion import report_motion
    from flexgui.export.outcome import export_outcome

    progress.stage("Writing the report")
    motion = report_motion(scenario, outcome, path.parent, data)
    found = diagnosed_beside(scenario, outcome, out, path.parent, data)
    export_outcome(outcome, text, out, motion, found)
