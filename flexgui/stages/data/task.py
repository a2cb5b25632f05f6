"""The check of the recordings, and the motion of one, in a worker."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexgui.core.check.finding import Finding
    from flexgui.core.progress import Progress
    from flexgui.core.recording.recording import Recording
    from flexgui.core.scenario.schema import Scenario
    from flexgui.scene.recorded import Playback


def findings(folder: str, scenario: Scenario, *, progress: Progress) -> tuple[Finding, ...]:
    """In the order of the recordings; InputError where one is no table of measurements. Files are
    those of the folder and no others."""
    from flexgui.core.check.run import check_scenario
    from flexgui.core.scenario.data_folder import Within

    return tuple(check_scenario(scenario, Within(Path(folder)), None, progress))


def play(
    scenario: Scenario, recording: str, folder: str, values: Mapping[str, float], *,
    progress: Progress,
) -> tuple[Recording, Playback]:  # fmt: skip
    """A file of `folder` only; `values` are the fitted parameters, none where there is no fit."""
    from flexgui.core.scenario.data_folder import Within
    from flexgui.scene.recorded import played, read_one

    found = read_one(scenario, recording, Within(Path(folder)), progress=progress)
    return found, played(scenario, values, found)
