"""Look into a file that a person brought."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from core.progress import Progress
    from core.scenario.schema import Scenario


def headers(folder: str, file: str, *, progress: Progress) -> tuple[str, ...]:
    """The headings of a table's columns; InputError where it is none, or none of the folder."""
    from core.recording.read_table import read_table
    from core.scenario.data_folder import Within

    return tuple(read_table(Within(Path(folder)).find(file), progress).columns)


def length_and_rate(
    folder: str, file: str, entry: Mapping[str, Any], scenario: Scenario, *, progress: Progress
) -> tuple[int, float]:
    """Samples and their rate in Hz of a recording of which nothing is missing that a motion of
    the scenario's arm needs; InputError else. `entry` is the scenario's table of it."""
    from core.errors import InputError
    from core.loading import joint_units
    from core.recording.load import load_recording
    from core.recording.spec import RecordingSpec
    from core.scenario.data_folder import Within
    from core.workbench import base_model

    model = base_model(scenario)
    spec = RecordingSpec.model_validate(dict(entry))
    references = model.drive.needed_channels(model.arm)
    path = Within(Path(folder)).find(file)
    found = load_recording(path, spec, references, joint_units(model.arm), progress)
    if model.arm.joints > 1 and found.theta2 is None and not found.has("theta2"):
        raise InputError(f"{file} does not give the position of joint 2; add a column theta2.")
    return len(found.time), 1.0 / found.sample_time
