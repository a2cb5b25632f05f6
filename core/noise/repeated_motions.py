"""Noise from repeated motions: what does not repeat is the best noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import gcd

import numpy as np

from ..identify.first_states import start_joints
from ..identify.fit import Fitted
from ..identify.prepared_recording import Prepared
from ..identify.repeatability import repeatability
from ..results import Estimate, Repeated

SAME_INPUTS = 1e-3
"""Mean square difference of two cycles' inputs over twice their variance: three per cent of the
motion, as a loop's own noise gives."""

DIFFERENT_INPUTS = 0.1
"""The same: above it a signal has left, so that a later return is a new cycle."""

SAME_INITIAL_STATE = 0.01
"""rad (m): largest difference of starts for the same motion."""

FEWEST_CYCLES = 2
"""Fewest cycles that show noise."""


@dataclass(frozen=True)
class Stretch:
    """A recording's compared samples from `start` on."""

    recording: int
    start: int


@dataclass(frozen=True)
class Group:
    """Stretches of the same motion, `length` compared samples each."""

    stretches: tuple[Stretch, ...]
    length: int


def repeated_groups(experiments: Sequence[Prepared]) -> list[Group]:
    """The cycles within each recording, or the recordings that repeat one another."""
    groups = [g for i, e in enumerate(experiments) if (g := _cycles(i, e)) is not None]
    return groups or _repeated_recordings(experiments)


def unrepeated_rms(
    groups: Sequence[Group], experiments: Sequence[Prepared], errors: Sequence[np.ndarray]
) -> dict[str, float]:
    """channel -> rms of the part of its error that does not repeat, SI.

    `errors` (M, k) per recording. The repeating part is model error; errors instead of signals
    leave out small differences of the motion.
    """
    squares: dict[str, list[np.ndarray]] = {}
    for group in groups:
        first = experiments[group.stretches[0].recording]
        drifts = [s.drifts for s in first.outputs for _ in s.channels(first.model.arm)]
        for k, (name, _) in enumerate(first.channels):
            stacked = _stacked(group, experiments, errors, k)
            whole = stacked[:, np.isfinite(stacked).all(axis=0)]
            if not whole.shape[1]:
                continue
            # Where a velocity loop leaves positions free, their means are no noise.
            if drifts[k] and not first.model.steering:
                whole = whole - whole.mean(axis=1, keepdims=True)
            squares.setdefault(name, []).append(np.var(whole, axis=0, ddof=1))
    return {n: float(np.sqrt(np.mean(np.concatenate(s)))) for n, s in squares.items()}


def _stacked(
    group: Group, experiments: Sequence[Prepared], errors: Sequence[np.ndarray], k: int
) -> np.ndarray:
    """(cycles, samples) of one channel's error; NaN where a sample does not count."""
    rows = []
    for s in group.stretches:
        e = experiments[s.recording]
        part = slice(s.start, s.start + group.length)
        counts = e.counted[part, k]
        rows.append(np.where(counts, errors[s.recording][part, k], np.nan))
    shortest = min(len(row) for row in rows)
    return np.array([row[:shortest] for row in rows])


def _cycles(i: int, e: Prepared) -> Group | None:
    """The cycles of one recording. The first of three or more is left out; of two, the first
    halves: a motion from rest takes time until it repeats. With decimation, as many cycles count as
    one as bring the compared samples back to the same instants of the motion."""
    repeats = period(motion_inputs(e))
    if repeats is None:
        return None
    length = repeats // gcd(repeats, e.processing.decimate)
    count = len(e.time) // length
    if count < FEWEST_CYCLES:
        return None
    first = 1 if count > FEWEST_CYCLES else 0
    skipped = 0 if first else length // 2
    starts = [Stretch(i, c * length + skipped) for c in range(first, count)]
    return Group(tuple(starts), length - skipped)


def motion_inputs(e: Prepared) -> np.ndarray:
    """(N, k) inputs of the motion: references, or the measured joints with a virtual servo."""
    if e.model.steering is None:
        return e.task.references
    joints = e.model.arm.joints
    return e.task.references[:, -2 * joints :][:, :joints]


def period(inputs: np.ndarray) -> int | None:
    """Period of inputs (N, k) in samples; None if longer than half of the recording."""
    N = len(inputs)
    moved = inputs - inputs.mean(axis=0)
    moved = moved[:, moved.std(axis=0) > 0.0]
    if not moved.shape[1] or N < 2 * FEWEST_CYCLES:
        return None
    moved = moved / moved.std(axis=0)
    difference = _lagged_difference(moved)[: N // FEWEST_CYCLES + 1]
    departed = np.flatnonzero(difference > DIFFERENT_INPUTS)
    if not departed.size:
        return None
    returned = np.flatnonzero(difference[departed[0] :] < SAME_INPUTS)
    if not returned.size:
        return None
    at = int(departed[0] + returned[0])
    while at + 1 < len(difference) and difference[at + 1] < difference[at]:
        at += 1
    return at


def _lagged_difference(x: np.ndarray) -> np.ndarray:
    """(N,) mean square of x(t + lag) - x(t) over twice the variance, by lag; x (N, k) has variance
    one."""
    N, k = x.shape
    size = 1 << (2 * N - 1).bit_length()
    spectrum = np.zeros(size // 2 + 1)
    for column in x.T:  # one after the other: a long recording's take hundreds of MB together
        F = np.fft.rfft(column, size)
        spectrum += F.real**2 + F.imag**2
    together = np.fft.irfft(spectrum, size)[:N]
    power = np.concatenate([[0.0], np.cumsum(np.sum(x**2, axis=1))])
    lags = np.arange(N)
    both = power[N - lags] + (power[N] - power[lags])
    return np.asarray((both - 2.0 * together) / (2.0 * k * np.maximum(N - lags, 1)))


def _repeated_recordings(experiments: Sequence[Prepared]) -> list[Group]:
    """Groups each recording with the first one of the same motion."""
    groups: dict[int, list[int]] = {}
    for i, e in enumerate(experiments):
        like = next((j for j in groups if _same_motion(experiments[j], e)), i)
        groups.setdefault(like, []).append(i)
    return [
        Group(tuple(Stretch(i, 0) for i in members), len(experiments[like].time))
        for like, members in groups.items()
        if len(members) >= FEWEST_CYCLES
    ]


def _same_motion(a: Prepared, b: Prepared) -> bool:
    first, second = motion_inputs(a), motion_inputs(b)
    same_time = np.isclose(a.recording.sample_time, b.recording.sample_time, rtol=1e-6)
    if first.shape != second.shape or not same_time:
        return False
    starts = [start_joints(e.model, e.recording) for e in (a, b)]
    variance = float(np.sum(np.var(first, axis=0)))
    if np.abs(starts[0] - starts[1]).max() > SAME_INITIAL_STATE or not variance:
        return False
    return float(np.sum(np.mean((first - second) ** 2, axis=0))) < 2.0 * SAME_INPUTS * variance


def compare_repeated_runs(fits: Sequence[Fitted]) -> tuple[Repeated, ...]:
    """Parameters over repeated recordings, if each has its own estimates (local fits or
    `per_recording`); none for fewer than three."""
    experiments = [e for f in fits for e in f.residuals.experiments]
    own = _own_estimates(fits)
    records: list[Repeated] = []
    for group in repeated_groups(experiments):
        names = [experiments[s.recording].recording.name for s in group.stretches]
        runs = {name: own[name] for name in names if own.get(name)}
        if len(runs) == len(names) == len(set(names)):
            records += repeatability(runs)
    return tuple(records)


def _own_estimates(fits: Sequence[Fitted]) -> dict[str, list[Estimate]]:
    own: dict[str, list[Estimate]] = {}
    for f in fits:
        single = f.fit.recordings[0] if len(f.fit.recordings) == 1 and len(fits) > 1 else None
        for e in f.fit.estimates:
            run = e.recording or single
            if run is not None:
                own.setdefault(run, []).append(e)
    return own
