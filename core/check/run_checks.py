"""All checks on the recordings of a scenario, or on one file."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..check.case import Case
from ..check.column_faults import FAMILIES
from ..check.finding import Check, Finding
from ..check.late_channels import FINE
from ..check.measured_recording import MeasuredRecording, noise_of
from ..check.suspect_channels import MAINLY
from ..errors import InputError
from ..loading import joint_units, simulated
from ..model import Model
from ..plugins import discover
from ..progress import Progress, Silent
from ..recording.channels import channel_kind, from_camera
from ..recording.clock import in_base_frame, shifted
from ..recording.load import load_unchecked
from ..recording.spec import RecordingSpec
from ..results import ChannelComparison, RecordingComparison
from ..scenario.data_folder import Folder, resolve_file
from ..scenario.schema import Scenario
from ..scenario.stated_effects import base_model
from ..sentences import did_you_mean

CLOCK_CHECKS = ("time_unit", "sample_time")
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
    explained: Container[str] = (),
) -> list[Finding]:
    """What is wrong with a scenario's recordings, in their order. Channels of those `explained` are
    not compared with one another, see `explained_by`. InputError without a recording, or for one
    that is no table of measurements."""
    progress = progress or Silent()
    recordings = measured_recordings(scenario, folder, data, progress)
    findings = check_all(recordings, progress.stopped, explained)
    return [*_unknown_parameters(scenario), *findings]


FIRST_SAMPLE = 3.0
"""Standard deviations of noise by which a whole channel may be shifted: an arm's posture is known
from one sample."""


def explained_by(comparisons: Sequence[RecordingComparison]) -> set[str]:
    """The recordings in which a fitted model leaves no channel that could be wrong.

    A wrong channel takes MAINLY of what is left unexplained. It cannot where more than that is
    white noise, or where what is left is below FINE of the channel's spread.
    """
    measured = {c.recording: _measured_channels(c) for c in comparisons}
    return {name for name, own in measured.items() if own and all(map(_is_explained, own))}


def _measured_channels(comparison: RecordingComparison) -> list[ChannelComparison]:
    """Those that a file holds; the others are computed from them."""
    return [c for c in comparison.channels if channel_kind(c.channel).pattern in FAMILIES]


def _is_explained(channel: ChannelComparison) -> bool:
    left, y = (x[channel.counted] for x in (channel.residual, channel.measured))
    if not left.size:
        return True
    noise, fine = noise_of(left), FINE * float(np.std(y))
    shifted = abs(float(np.mean(left))) > max(FIRST_SAMPLE * noise, fine)
    return not shifted and float(np.std(left)) < max(noise / np.sqrt(MAINLY), fine)


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
    progress.stage("Checking the recordings", len(scenario.recordings))
    recordings = []
    for spec in scenario.recordings:
        recordings.append(_measured(spec, scenario, model, folder, data, progress))
        progress.advance(text=spec.name)
    return recordings


def check_file(path: Path, progress: Progress | None = None) -> list[Finding]:
    """Faults of a single file; without an arm, no channel is compared with another's dynamics."""
    spec = RecordingSpec(file=path.name, name=path.name)
    progress = progress or Silent()
    return check_all([_read(path, spec, None, progress)], progress.stopped)


def check_all(
    recordings: Sequence[MeasuredRecording],
    stopped: Callable[[], bool] = lambda: False,
    explained: Container[str] = (),
) -> list[Finding]:
    """The findings of recordings of one rig, in order; those so far if stopped. Channels of
    `explained` recordings are not compared with one another."""
    clocked = [with_true_clock(r, r.name in explained) for r in recordings if not stopped()]
    cases = [case for case, _ in clocked]
    all_findings: list[Finding] = []
    for case, findings in clocked:
        whole = Case(case.recording, [o for o in cases if o is not case])
        kinds = _kinds(case.recording.name in explained)
        all_findings += [*findings, *check_case(whole, stopped, kinds)]
    return all_findings


def _kinds(explained: bool) -> dict[str, Check]:
    """The checks of a recording; those that compare channels only where it is not `explained`."""
    return {k: c for k, c in checks().items() if not (explained and c.compares_channels)}


def check_case(
    case: Case,
    stopped: Callable[[], bool] = lambda: False,
    kinds: Mapping[str, Check] | None = None,
) -> list[Finding]:
    """The findings of one recording with a correct clock; `kinds`: of these checks only."""
    findings: list[Finding] = []
    for kind, check in (checks() if kinds is None else kinds).items():
        if stopped():
            break
        if kind not in CLOCK_CHECKS:
            findings += check.find(case)
    return findings


def with_true_clock(
    recording: MeasuredRecording, explained: bool = False
) -> tuple[Case, list[Finding]]:
    """The recording on its true clock, and the findings of the clock."""
    findings: list[Finding] = []
    case = Case(recording)
    kinds = _kinds(explained)
    for kind in (k for k in CLOCK_CHECKS if k in kinds):
        for finding in kinds[kind].find(case):
            findings.append(finding)
            case = Case(replace(case.recording, time=case.recording.time / finding.size))
    return case, findings


def _measured(
    spec: RecordingSpec, scenario: Scenario, model: Model, folder: Folder, data: Path | None,
    progress: Progress,
) -> MeasuredRecording:  # fmt: skip
    if spec.simulate is None:
        assert spec.file is not None
        return _read(resolve_file(spec.file, folder, data), spec, model, progress)
    recording = simulated(spec, scenario.sensors, model)
    return MeasuredRecording(
        spec.name, spec.role, recording.time, recording.channels, masks=recording.counted,
        model=model,
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
        spec.name, spec.role, raw.time, channels, raw.headers, model=model
    )
    if spec.time_shift:
        for name in [n for n in channels if from_camera(n)]:
            channels[name] = shifted(channels[name], spec.time_shift / recording.step)
    masks = {
        name: ~np.any([(raw.time >= a) & (raw.time <= b) for a, b in stretches], axis=0)
        for name, stretches in spec.mask.items()
        if name in channels and stretches
    }
    return replace(recording, channels=channels, masks=masks)
