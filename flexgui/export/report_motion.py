"""The arm's motion in 3-D, as a part of the report."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from flexgui.core.diagnosed_scenario import diagnosed_scenario
from flexgui.core.errors import InputError
from flexgui.core.identify.unknowns import GAIN, OFFSET
from flexgui.core.recording.recording import Recording
from flexgui.core.results import Outcome
from flexgui.core.results.identification import values_in
from flexgui.core.scenario.data_folder import Folder
from flexgui.core.scenario.schema import Scenario

if TYPE_CHECKING:
    from flexgui.scene.recorded_motion import RecordedMotion


NO_PLAYER = (
    "The 3-D motion is left out, because viser is missing. Install the extra `page` of FlexGUI and "
    "export again."
)


@dataclass(frozen=True)
class Motion:
    """A player and what it plays; the player is empty where `note` says why there is none."""

    player: Markup
    note: str


def report_motion(
    scenario: Scenario, outcome: Outcome, folder: Folder, data: Path | None = None
) -> Motion | None:
    """Motion of the first validation recording, else of the first; None without one.

    A report without it is still a report: what cannot be read again or drawn is left out, and said.
    """
    if find_spec("viser") is None:
        return Motion(Markup(""), NO_PLAYER)
    from flexgui.scene.motion_page import MOST_SECONDS, embedded, playback_html, playback_note
    from flexgui.scene.recorded_motion import read_recording

    ordered = sorted(scenario.recordings, key=lambda spec: spec.role != "validate")
    if not ordered:
        return None
    try:
        recording = read_recording(scenario, ordered[0].name, folder, data)
        end = np.searchsorted(recording.time, recording.time[0] + MOST_SECONDS)
        shown = _shown(scenario, outcome, recording.rows(slice(int(end) + 1)))
        page = playback_html(shown.motion, shown.ghost, shown.exaggeration)
    except (InputError, OSError) as error:
        return Motion(Markup(""), f"The 3-D motion is left out: {error}")
    title = f"Motion of {shown.recording}"
    ghost = "" if shown.ghost is None else " The translucent arm is the measured one."
    note = f"{shown.recording}: {playback_note(shown.motion, shown.exaggeration)}{ghost}"
    return Motion(Markup(embedded(page, title)), note)


def _shown(scenario: Scenario, outcome: Outcome, recording: Recording) -> RecordedMotion:
    """Of the model after the diagnosis."""
    from flexgui.scene.recorded_motion import simulated_motion
    from flexgui.views.headline import fitted_values

    diagnosis = outcome.diagnosis
    if diagnosis is None or not (diagnosis.added and diagnosis.values):
        return simulated_motion(scenario, fitted_values(outcome, recording.name), recording)
    own = values_in(recording.name, diagnosis.values)
    values = {name: x for name, x in own.items() if not name.startswith((OFFSET, GAIN))}
    return simulated_motion(diagnosed_scenario(scenario, diagnosis), values, recording)
