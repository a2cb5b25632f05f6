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
    *,
    progress: Progress,
) -> Outcome:
    """Everything that the scenario asks for; it may read the files of `folder` only."""
    from core.scenario.data_folder import Within
    from core.scenario.read import parse_scenario
    from core.workbench import run_scenario

    return run_scenario(
        parse_scenario(scenario_toml, "The scenario"),
        folder=Within(Path(folder or ".")),
        progress=progress,
    )
