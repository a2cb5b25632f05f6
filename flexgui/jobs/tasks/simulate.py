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
    data_folder: str | None = None,
    *,
    progress: Progress,
) -> tuple[Recording, ...]:
    """All recordings, simulated or read, in the scenario's order."""
    from core.loading import load_recordings
    from core.scenario.read import parse_scenario
    from core.workbench import base_model

    scenario = parse_scenario(scenario_toml, "The scenario")
    progress.stage("Making the recordings", len(scenario.recordings))
    found = load_recordings(
        scenario,
        base_model(scenario),
        Path(folder) if folder else Path(),
        Path(data_folder) if data_folder else None,
        progress,
    )
    return tuple(found)
