"""Time stamps in another unit, out of order, uneven, or too fast or too slow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ...check.case import Case, Dynamics
from ...check.channel_relations import relations
from ...check.column_faults import TIE, ColumnFault
from ...check.finding import RESAMPLE_LINE, Check, Finding
from ...check.inverse_dynamics import loop_gains
from ...check.link_bending import LinkShape
from ...check.measured_recording import MeasuredRecording
from ...recording.channels import Role, role_of

SLOWEST = 0.25
"""s: no logger of a moving arm samples more seldom than 4 Hz."""
UNITS = ((1e3, "ms"), (1e6, "us"), (1e9, "ns"))


class TimeUnit(Check):
    """A sample time that no logger has."""

    kind = "time_unit"

    def find(self, case: Case) -> Iterable[Finding]:
        step = case.recording.stated_step
        if step <= SLOWEST:
            return
        factor, unit = next((u for u in UNITS if step / u[0] <= SLOWEST), UNITS[-1])
        sentence = f"t steps by {step:g}; as seconds that is {1 / step:.3g} Hz, so it is in {unit}"
        fix = case.columns({"t": ("t", {"unit": unit})})
        yield case.finding(self.kind, "t", factor, "", sentence, fix)


class RepeatedTimes(Check):
    """Time stamps that do not increase."""

    kind = "repeated_times"

    def find(self, case: Case) -> Iterable[Finding]:
        time = case.recording.time
        steps = np.diff(time[np.isfinite(time)])
        count = int(np.sum(steps <= 0))
        if count:
            back = int(np.sum(steps < 0))
            sentence = f"non-increasing timestamps: {count - back} repeat and {back} decrease"
            yield case.finding(self.kind, "t", count, "samples", sentence, RESAMPLE_LINE)


SHARE = 0.02
"""Of the sample time; rounding of the time column and real loggers stay below 1 %."""


class Jitter(Check):
    """Steps of the time column that scatter."""

    kind = "jitter"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        time = recording.time[np.isfinite(recording.time)]
        if len(time) < 20:
            return
        steps = np.diff(time)
        whole = np.round(steps / recording.step)
        plain = steps[whole == 1.0] if np.mean(whole == 1.0) > 0.5 else steps
        # Two neighbouring stamps scatter independently: their distance has twice the variance.
        spread = float(np.std(plain)) / np.sqrt(2.0)
        many = float(np.mean(np.abs(plain - np.median(plain)) > SHARE * recording.step))
        if spread > SHARE * recording.step and many > 0.2:
            size = f"{1e3 * spread:.3g} ms"
            sentence = f"t scatters by {size} around an even clock of {recording.step:.4g} s"
            yield case.finding(self.kind, "t", spread, "s", sentence, RESAMPLE_LINE)


FACTORS = (0.1, 0.2, 0.25, 0.4, 0.5, 2.0, 2.5, 4.0, 5.0, 10.0)
"""Wrong sample times are slips of rates: 1 and 2 kHz, 100 and 250 Hz, a decimal."""
VISCOUS = 1.6
"""Ratio of a reference to a speed that viscous friction makes, at most: it takes 0.6 of what the
loop gives at that speed."""
NEAR = 4.0
"""Ratio to what the speeds say by themselves: with a wrong clock no stiffness fits the torques, and
they draw the speeds' gain along."""
RIGHT = 0.3
"""What is left, in ln, of the speeds (beyond viscous friction) and of the roots of the torques with
the right clock: a gain that is stated 30 % wrong makes half of it. With a place that has a wrong
factor of 2 the two disagree by 0.35."""
GOOD, BAD = 0.9, 0.75
"""Share of the encoders' variance explained with the right clock, and with a wrong one; elastic
joints leave 0.78 with the right one (scenarios/mujoco)."""


Gains = Sequence[tuple[float, float, float]]
"""Per joint the gains of speed and torque, and the share that they explain."""


def clock_speed(case: Case) -> tuple[float, float, float] | None:
    """(stated over true sample time, share explained with the true one, and as stated)."""
    recording = case.recording
    if recording.model is None or not recording.names("dtheta#_ref"):
        return None
    # Columns are corrected, which takes seconds, only where the speeds look wrong as they are read.
    as_read = _gains(recording, Dynamics(recording).shape)
    if as_read and not _is_wrong(_speed_gain(as_read)):
        return None
    if stated := _gains(recording, case.dynamics.shape):
        return _by_speeds(recording, stated)
    before = _explained(recording)
    if before is None or before > BAD:
        return None
    best = (0.0, 1.0)
    for factor in FACTORS:
        score = _explained(replace(recording, time=recording.time / factor))
        if score is not None and score > best[0]:
            best = (score, factor)
    return (best[1], best[0], before) if best[0] > max(GOOD, before + 0.1) else None


def _by_speeds(recording: MeasuredRecording, stated: Gains) -> tuple[float, float, float] | None:
    """The same of velocity loops whose joints are measured, with stiffness and friction free: a
    clock is wrong by what all joints' speeds are wrong by, and the torques by its square."""
    speed_gain = _speed_gain(stated)
    if not _is_wrong(speed_gain):
        return None
    best: tuple[float, float, float] | None = None
    for factor in FACTORS:
        if abs(np.log(factor / max(speed_gain, 1e-3))) > np.log(NEAR):
            continue
        other = replace(recording, time=recording.time / factor)
        gains = _gains(other, Dynamics(other).shape)
        right = [_off(speed) + 0.5 * abs(np.log(max(torque, 1e-3))) for speed, torque, _ in gains]
        deviation, share = float(np.median(right)), float(np.median([e for *_, e in gains]))
        if deviation < RIGHT and share > BAD and (best is None or deviation < best[0]):
            best = deviation, factor, share
    return None if best is None else (best[1], best[2], float(np.median([e for *_, e in stated])))


def _gains(recording: MeasuredRecording, shape: LinkShape | None) -> Gains:
    return [] if shape is None else loop_gains(recording, shape)


def _speed_gain(gains: Gains) -> float:
    """Median over the joints of the ratio of a reference to its speed."""
    return float(np.median([abs(speed) for speed, *_ in gains]))


def _is_wrong(speed_gain: float) -> bool:
    return abs(float(np.log(max(speed_gain, 1e-3)))) >= np.log(VISCOUS)


def _off(speed: float) -> float:
    """|ln| of a speed's gain, where viscous friction does not explain it."""
    return 0.0 if 1.0 <= speed <= VISCOUS else abs(float(np.log(max(speed, 1e-3))))


def _explained(recording: MeasuredRecording) -> float | None:
    """The mean over the encoders, at gains near one; a gain far from one explains nothing."""
    encoders = [r for r in relations(recording, quick=True) if role_of(r.output) is Role.PLACE]
    loops = [r for r in encoders if len(r.inputs) == len(recording.names("theta#"))]
    loops = [r for r in loops if role_of(r.inputs[0]) is Role.SPEED]
    if not loops:
        return None
    return float(np.mean([r.explained if 0.7 < r.gain < 1.4 else 0.0 for r in loops]))


class SampleTime(Check):
    """The loop's motion fits only with another sample time."""

    kind = "sample_time"
    compares_channels = True

    def find(self, case: Case) -> Iterable[Finding]:
        result = clock_speed(case)
        if result is None:
            return
        clock = ColumnFault(self.kind, ("t",), result[0]).improvement(case.recording)
        if clock < max([TIE, *(fault.improvement(case.recording) for fault in case.causes[:1])]):
            return
        factor, explained, before = result
        step = case.recording.step / factor
        sentence = (
            f"the motion fits the references with {step:.4g} s per row ({explained:.1%} explained) "
            f"instead of {case.recording.step:.4g} s ({max(before, 0.0):.1%})"
        )
        fix = case.columns({"t": ("t", {"gain": f"{1.0 / factor:.6g}"})})
        yield case.finding(self.kind, "t", factor, "", sentence, fix)
