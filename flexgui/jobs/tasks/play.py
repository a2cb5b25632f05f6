"""Read or simulate one recording, and compute its motion."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.progress import Progress
    from core.recording.recording import Recording
    from core.scenario.schema import Scenario
    from flexgui.stage.recorded import Playback


def play(
    scenario: Scenario, recording: str, folder: str, values: Mapping[str, float], *,
    progress: Progress,
) -> tuple[Recording, Playback]:  # fmt: skip
    """A file of `folder` only; `values` are the fitted parameters, none where there is no fit."""
    from core.scenario.data_folder import Within
    from flexgui.stage.recorded import played, read_one

    found = read_one(scenario, recording, Within(Path(folder)), progress=progress)
    return found, played(scenario, values, found)
