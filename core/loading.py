"""The recordings of a scenario, read from files or simulated."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from core.arm.arm import Arm
from core.arm.joints import joint
from core.errors import InputError
from core.model import Model
from core.progress import Progress
from core.recording.load import load_recording
from core.recording.played import as_played
from core.recording.recording import Recording
from core.recording.spec import RecordingSpec
from core.scenario.data_folder import Folder, resolve_file
from core.scenario.schema import Scenario, SensorsSpec
from core.scenario.stated_effects import with_hidden_effects
from core.sensors import sensors
from core.simulate.experiment import NoiseLevels, simulate_recording

WORKERS = 2
"""Simulation holds no lock; machines have two cores."""


def load_recordings(
    scenario: Scenario, model: Model, folder: Folder, data_folder: Path | None, progress: Progress
) -> list[Recording]:
    """All of them, in the scenario's order; InputError names the file that is wrong."""
    if not scenario.recordings:
        raise InputError("The scenario has no [[recordings]]; add at least one.")

    def one(spec: RecordingSpec) -> Recording:
        if spec.simulate is not None:
            progress.advance(0, f"{spec.name}, {spec.simulate.samples:,} samples to simulate")
            found = simulated(spec, scenario.sensors, model)
        else:
            found = _read(spec, model, folder, data_folder, progress)
        progress.advance(text=spec.name)
        return found

    _ = (model.bare or model).compiled  # once, before the threads ask for it
    with ThreadPoolExecutor(WORKERS) as pool:
        return list(pool.map(one, scenario.recordings))


def _read(
    spec: RecordingSpec, model: Model, folder: Folder, data_folder: Path | None, progress: Progress
) -> Recording:
    assert spec.file is not None
    path = resolve_file(spec.file, folder, data_folder)
    required, units = model.drive.needed_channels(model.arm), joint_units(model.arm)
    if spec.played is None:
        return load_recording(path, spec, required, units, progress)
    references = load_recording(
        resolve_file(spec.played, folder, data_folder), RecordingSpec(file=spec.played),
        model.drive.reference_channels(model.arm), units,
    )  # fmt: skip
    needed = [name for name in required if not references.has(name)]
    return as_played(load_recording(path, spec, needed, units, progress), references)


def joint_units(arm: Arm) -> dict[str, str]:
    """SI units of the channels of each joint: a slide is not measured in radians."""
    units: dict[str, str] = {}
    for k, segment in enumerate(arm.segments, start=1):
        kind = joint(segment.joint)
        place = kind.coordinate_unit
        units |= {f"theta{k}": place, f"theta{k}_ref": place, f"dtheta{k}_ref": f"{place}/s"}
        units |= {f"link_theta{k}": place}
        units |= {f"u{k}": kind.effort_unit, f"known_torque{k}": kind.effort_unit}
    return units


def simulated(spec: RecordingSpec, noise: SensorsSpec, model: Model) -> Recording:
    """From the bare model and the recording's hidden effects, whatever else the model has."""
    assert spec.simulate is not None
    model = with_hidden_effects(model, spec.hidden, spec.name)
    _check_level(spec.simulate.level, model, spec.name)
    levels = noise_levels(noise)
    recording = simulate_recording(model, spec.simulate, spec.name, spec.role, levels)
    masks = {}
    for channel, stretches in spec.mask.items():
        keep = recording.mask(channel).copy()
        for low, high in stretches:
            keep &= (recording.time < low) | (recording.time > high)
        masks[channel] = keep
    return replace(recording, counted=masks)


def noise_levels(stated: SensorsSpec) -> NoiseLevels:
    """The noise that `[sensors]` states, by kind of sensor; each names its setting itself."""
    known = {kind: stated.noise_of(one.noise) for kind, one in sensors().items()}
    return NoiseLevels({k: v for k, v in known.items() if v is not None}, stated.camera_rate)


def _check_level(level: str, model: Model, name: str) -> None:
    """A linear simulation has no place for some effects; leaving them out silently would lie."""
    lost = [one.kind for one in model.effects if one.level(level) != level]
    if lost:
        raise InputError(
            f"Recording {name}: a linear simulation cannot have the hidden effect {lost[0]}; use "
            f'simulate.level = "nonlinear".'
        )
