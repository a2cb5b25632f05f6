"""Make the recordings of a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.progress import Progress
    from core.recording.recording import Recording


def simulate(
    scenario_toml: str,
    folder: str | None = None,
    *,
    progress: Progress,
) -> tuple[Recording, ...]:
    """All recordings in the scenario's order, simulated or read from files of `folder` only."""
    from core.loading import load_recordings
    from core.scenario.data_folder import Within
    from core.scenario.read import parse_scenario
    from core.workbench import base_model

    scenario = parse_scenario(scenario_toml, "The scenario")
    progress.stage("Making the recordings", len(scenario.recordings))
    found = load_recordings(
        scenario,
        base_model(scenario),
        Within(Path(folder or ".")),
        None,
        progress,
    )
    return tuple(found)
