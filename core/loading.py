"""The recordings of a scenario, read from files or simulated; those of a planned experiment are cut
to what was played.

A logger starts before a planned motion and ends after it, and some write no references.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy

from .arm.arm import Arm
from .arm.joints import joint
from .errors import InputError
from .model import Model
from .processors import thread_pool
from .progress import Progress
from .recording.initial_motion import with_beginnings
from .recording.load import load_recording, outside
from .recording.recording import Recording
from .recording.spec import RecordingSpec
from .scenario.data_folder import Folder, resolve_file
from .scenario.rig_spec import SensorsSpec
from .scenario.schema import Scenario
from .scenario.stated_effects import with_hidden_effects
from .sensors import sensors
from .simulate.experiment import NoiseLevels, simulate_recording
from .validation import naming_scenario


@naming_scenario
def load_recordings(
    scenario: Scenario, model: Model, folder: Folder, data_folder: Path | None, progress: Progress
) -> list[Recording]:
    """All of them, in the scenario's order; InputError names the file that is wrong."""
    if not scenario.recordings:
        raise InputError("The scenario has no [[recordings]]; add at least one.")

    def load(spec: RecordingSpec) -> Recording:
        if spec.simulate is not None:
            progress.advance(0, f"{spec.name}, {spec.simulate.samples:,} samples to simulate")
            loaded = simulated(spec, scenario.sensors, model)
        else:
            loaded = _read(spec, model, folder, data_folder, progress)
        progress.advance(text=spec.name)
        return loaded

    _ = (model.bare or model).compiled  # once, before the threads ask for it
    with thread_pool(len(scenario.recordings)) as pool:
        loaded = list(pool.map(load, scenario.recordings))
    # What is simulated begins at rest; what a rig wrote begins where somebody cut it.
    files = [r for r, spec in zip(loaded, scenario.recordings, strict=True) if spec.file]
    arm, drive = model.arm, model.drive
    held = drive.holds_joints(drive.law(arm, model.numbers().p, {}))
    weighs = any(arm.gravity) and arm.coordinates > arm.joints
    marked = with_beginnings(files, arm.joints, drive.reference_channels(arm), held, weighs)
    by_name = {r.name: r for r in marked}
    return [by_name.get(r.name, r) for r in loaded]


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
    masks = {c: recording.mask(c) & outside(recording.time, s) for c, s in spec.mask.items()}
    return replace(recording, counted=masks)


def noise_levels(stated: SensorsSpec) -> NoiseLevels:
    """The noise that `[sensors]` states, by kind of sensor; each names its setting itself."""
    levels = {kind: stated.noise_of(sensor.noise) for kind, sensor in sensors().items()}
    return NoiseLevels({k: v for k, v in levels.items() if v is not None}, stated.camera_rate)


def _check_level(level: str, model: Model, name: str) -> None:
    """A linear simulation has no place for some effects; leaving them out silently would lie."""
    absent = [effect.kind for effect in model.effects if effect.level(level) != level]
    if absent:
        raise InputError(
            f"Recording {name}: a linear simulation cannot have the hidden effect {absent[0]}; use "
            f'simulate.level = "nonlinear".'
        )


APART = 0.1
"""Share of the references' own spread by which recorded and played ones may differ: quantisation
and noise of a logger stay below a hundredth, another experiment is as far apart as its spread."""


def as_played(recording: Recording, play: Recording) -> Recording:
    """The recording from the first sample of `play`, references (N,) of each channel, to the last,
    with them where it has none; without references it starts when the playing starts. InputError
    where its references are not those that were played, or too short."""
    dt = recording.sample_time
    names = list(play.channels)
    length = max(int(round(len(play.time) * play.sample_time / dt)), 1)
    index = np.floor(np.arange(length) * dt / play.sample_time + 1e-6)
    rows = np.minimum(index.astype(int), len(play.time) - 1)
    played = {name: play.channels[name][rows] for name in names}
    have = [name for name in names if recording.has(name)]
    count = min(len(rows), len(recording.time))
    if have and len(recording.time) < len(rows):
        raise InputError(
            f"{recording.source} is shorter than the references in {play.source} "
            f"({len(recording.time) * dt:.3g} s of {len(rows) * dt:.3g} s); record all of them, or "
            "leave `played` out."
        )
    first = _best_start(recording, played, have, play.source) if have else 0
    part = recording.rows(slice(first, first + count))
    added = {name: played[name][:count] for name in names if name not in have}
    return replace(part, time=part.time - part.time[0], channels={**part.channels, **added})


def _best_start(
    recording: Recording, played: dict[str, np.ndarray], have: list[str], source: str
) -> int:
    """The sample at which the references fit best; InputError where they nowhere do."""
    misses = 0.0
    spread = sum(float(np.sum((played[n] - played[n].mean()) ** 2)) for n in have)
    for name in have:
        r, p = recording.channels[name], played[name]
        squares = np.cumsum(np.concatenate([[0.0], r**2]))
        inside = squares[len(p) :] - squares[: -len(p)]
        product = scipy.signal.fftconvolve(r, p[::-1], mode="valid")
        misses = misses + inside - 2.0 * product + np.sum(p**2)
    first = int(np.argmin(misses))
    apart = float(np.sqrt(max(np.asarray(misses)[first], 0.0) / max(spread, 1e-300)))
    if apart > APART:
        raise InputError(
            f"{recording.source} does not match {source}: the recorded references differ from the "
            f"planned ones by {100.0 * apart:.0f} % of their spread; choose the file that belongs "
            "to it, or leave `played` out."
        )
    return first
