"""All checks on the recordings of a scenario, or on one file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ..check.case import Case
from ..check.finding import Check, Finding
from ..check.measured_recording import MeasuredRecording
from ..errors import InputError
from ..loading import joint_units, simulated
from ..model import Model
from ..plugins import discover
from ..progress import Progress, Silent
from ..recording.channels import from_camera
from ..recording.clock import in_base_frame, shifted
from ..recording.load import load_unchecked, outside
from ..recording.spec import RecordingSpec
from ..results.identification import values_in
from ..scenario.data_folder import Folder, resolve_file
from ..scenario.schema import Scenario
from ..scenario.stated_effects import base_model
from ..sentences import did_you_mean

CLOCK_CHECKS = ("time_unit",)
"""Faults of the clock, corrected first: every speed depends on it."""

SENSOR_PREFIXES = ("offset_", "gain_", "start_")
"""Prefixes of parameters of sensors and starts in [identify]."""


def checks() -> dict[str, Check]:
    """All checks by the fault that they look for."""
    return discover(f"{__package__}.checks", Check)


def check_scenario(
    scenario: Scenario,
    folder: Folder,
    data: Path | None = None,
    progress: Progress | None = None,
    values: Mapping[str, float] = MappingProxyType({}),
    sized: bool = True,
) -> list[Finding]:
    """What is wrong with a scenario's recordings, in their order; InputError without a recording,
    or for one that is no table of measurements.

    Args:
        values: Of parameters by label, as identified: where they leave noise, nothing is looked
            for.
        sized: Whether gains, offsets, delays and clocks are asked for. A diagnosis asks for them
            itself: they are effects.
    """
    progress = progress or Silent()
    recordings = measured_recordings(scenario, folder, data, progress)
    known = [replace(r, values=values_in(r.name, values)) for r in recordings]
    findings = check_all(known, progress, sized)
    dismissed = {(spec.name, key) for spec in scenario.recordings for key in spec.dismissed}
    left = [f for f in findings if (f.recording, f.key) not in dismissed]
    return [*_unknown_parameters(scenario), *left]


def _unknown_parameters(scenario: Scenario) -> Iterator[Finding]:
    model = base_model(scenario)
    for name in scenario.identify.parameters:
        if not name.startswith(SENSOR_PREFIXES) and name not in model.parameters:
            sentence = f"not a parameter of this arm; {did_you_mean(name, model.parameters)}"
            yield Finding("unknown_parameter", "[identify]", name, 1.0, "", sentence)


def measured_recordings(
    scenario: Scenario, folder: Folder, data: Path | None = None, progress: Progress | None = None
) -> list[MeasuredRecording]:
    """A scenario's recordings for the checks. InputError without any, or for one that is no table
    of measurements."""
    if not scenario.recordings:
        raise InputError("The scenario has no [[recordings]]; add at least one.")
    model = base_model(scenario)
    progress = progress or Silent()
    progress.stage("Reading the recordings", len(scenario.recordings))
    recordings = []
    for spec in scenario.recordings:
        recordings.append(_measured(spec, scenario, model, folder, data, progress))
        progress.advance(text=spec.name)
    return recordings


def check_file(path: Path, progress: Progress | None = None) -> list[Finding]:
    """Faults of a single file; without an arm, no channel is compared with another's dynamics."""
    spec = RecordingSpec(file=path.name, name=path.name)
    return check_all([_read(path, spec, None, progress)], progress)


def check_all(
    recordings: Sequence[MeasuredRecording],
    progress: Progress | None = None,
    sized: bool = True,
) -> list[Finding]:
    """The findings of recordings of one rig, in order; those so far if stopped."""
    progress = progress or Silent()
    progress.stage("Checking the recordings", len(recordings) * len(checks()))
    clocked = [with_true_clock(r) for r in recordings]
    cases = [Case(r, [], k, progress.stopped, sized) for k, (r, _) in enumerate(clocked)]
    for case in cases:
        case.others.extend(o for o in cases if o is not case)
    all_findings: list[Finding] = []
    for case, (_, findings) in zip(cases, clocked, strict=True):
        if progress.stopped():
            break
        all_findings += [*findings, *check_case(case, progress)]
    return all_findings


def check_case(case: Case, progress: Progress | None = None) -> list[Finding]:
    """The findings of one recording with a correct clock; the progress gets each check."""
    progress = progress or Silent()
    findings: list[Finding] = []
    for kind, check in checks().items():
        if case.stopped():
            break
        if kind not in CLOCK_CHECKS:
            findings += check.find(case)
        progress.advance(text=case.recording.name)
    return findings


def with_true_clock(
    recording: MeasuredRecording,
) -> tuple[MeasuredRecording, list[Finding]]:
    """The recording on its true clock, and the findings of the clock."""
    findings: list[Finding] = []
    for kind in CLOCK_CHECKS:
        for finding in checks()[kind].find(Case(recording)):
            findings.append(finding)
            recording = replace(recording, time=recording.time / finding.size)
    return recording, findings


def _measured(
    spec: RecordingSpec, scenario: Scenario, model: Model, folder: Folder, data: Path | None,
    progress: Progress,
) -> MeasuredRecording:  # fmt: skip
    if spec.simulate is None:
        assert spec.file is not None
        read = _read(resolve_file(spec.file, folder, data), spec, model, progress)
        return replace(read, identify=scenario.identify)
    recording = simulated(spec, scenario.sensors, model)
    return MeasuredRecording(
        spec.name, spec.role, recording.time, recording.channels, masks=recording.counted,
        model=model, identify=scenario.identify,
    )  # fmt: skip


def _read(
    path: Path, spec: RecordingSpec, model: Model | None, progress: Progress | None
) -> MeasuredRecording:
    units = {} if model is None else joint_units(model.arm)
    raw = load_unchecked(path, spec, units, progress)
    if raw.time is None or np.isfinite(raw.time).sum() < 10:
        raise InputError(
            f"{path.name} has no column t with at least ten timestamps; map one to t under columns."
        )
    channels = {n: v for n, v in raw.channels.items() if np.isfinite(v).any()}
    pose = spec.camera.pose()
    if "z1" in channels and "z2" in channels:
        channels["z1"], channels["z2"] = in_base_frame(channels["z1"], channels["z2"], pose)
    recording = MeasuredRecording(
        spec.name, spec.role, raw.time, channels, raw.headers,
        logger_filters=spec.logger_filters, camera=spec.camera_in_base_frame, model=model,
        unknown_gains=spec.unknown_gains,
    )  # fmt: skip
    if spec.time_shift:
        for name in [n for n in channels if from_camera(n)]:
            channels[name] = shifted(channels[name], spec.time_shift / recording.step)
    masks = {n: outside(raw.time, parts) for n, parts in spec.mask.items() if n in channels}
    return replace(recording, channels=channels, masks=masks)
