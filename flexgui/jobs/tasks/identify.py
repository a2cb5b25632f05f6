"""Run a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.progress import Progress
    from core.results import Outcome


def identify(
    scenario_toml: str,
    folder: str | None = None,
    data_folder: str | None = None,
    *,
    progress: Progress,
) -> Outcome:
    """Everything that the scenario asks for; `folder` is where its relative files are sought."""
    from core.scenario.read import parse_scenario
    from core.workbench import run_scenario

    return run_scenario(
        parse_scenario(scenario_toml, "The scenario"),
        folder=Path(folder) if folder else None,
        data_folder=Path(data_folder) if data_folder else None,
        progress=progress,
    )
