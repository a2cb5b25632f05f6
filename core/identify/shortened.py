"""What a search works on where recordings are long: fewer samples, and if need be a part of them.

The answer never rests on it: it is where the last refinement begins, which takes all samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.effects.effect import Effect
from core.effects.sizes import typical
from core.errors import InputError
from core.identify.predictor import Predictor
from core.identify.prepared import Prepared, Processing, prepare
from core.identify.residuals import channel_weights
from core.identify.unknowns import Unknowns
from core.recording.recording import Recording
from core.recording.thinning import PASS, first_part, largest_factor, sentence, thinned

MOST_SAMPLES = 30_000
"""Of all recordings together, on which a search takes a few seconds; more are shortened."""

FEWEST_SAMPLES = 2_000
"""Of one recording that is shortened: some periods of the slowest motion at ten per period."""

PER_PERIOD = 1.0 / PASS
"""Samples per period of the fastest motion that matters: the low-pass changes nothing below."""

PER_PERIOD_BETWEEN = 10.0
"""The same where a delay or a logger's filter is applied to the outputs: straight lines between
samples then miss 5 % of the fastest, and of the rest far less."""

LEFT_ABOVE = 1e-3
"""Of what the outputs tell about a parameter: what may lie above the fastest motion that matters.
The estimate of a search then loses nothing that could be seen."""

STIFFER = 2.0
"""Factor by which the motion may be faster than at the start: stiffnesses were off by 4, so that
modes were off by 2."""

AT_REST = 0.05
"""Of a joint's range: what it moves by before a motion has begun."""


@dataclass(frozen=True)
class Shortened:
    """The experiments of the search and how they came about."""

    experiments: tuple[Prepared, ...]
    factors: tuple[int, ...]
    """Per recording: every so many instants were kept."""
    note: str

    @property
    def sentence(self) -> str:
        """What begins, in few words."""
        kept = sum(len(e.recording.time) for e in self.experiments)
        return f"searching with {kept:,} samples"

    def hand_on_steps(self, searched: Predictor, whole: Predictor) -> None:
        """Lets all samples be simulated in steps half as long as the search needed, where their
        error was estimated: an eighth of it is left, as all samples tell an estimate the more
        sharply."""
        for e, factor in zip(self.experiments, self.factors, strict=True):
            name = e.recording.name
            if name in searched.substeps:
                whole.substeps[name] = 2 * max(-(-searched.substeps[name] // factor), 2)
                whole.errors[name] = searched.errors[name]
        if searched.steps is not None:
            whole.steps = max(-(-searched.steps // min(self.factors)), 1)


def is_long(experiments: Sequence[Prepared]) -> bool:
    """Whether a search takes fewer samples than there are."""
    return sum(len(e.recording.time) for e in experiments) > MOST_SAMPLES


def shortened(
    experiments: Sequence[Prepared], unknowns: Unknowns, fixed: Mapping[str, float]
) -> Shortened | None:
    """The experiments with as many samples as a search needs; None where they have no more."""
    if not is_long(experiments):
        return None
    longest = _longest_sample_time(experiments, unknowns, fixed)
    most = max(MOST_SAMPLES // len(experiments), FEWEST_SAMPLES)
    found, by = [], []
    for e in experiments:
        factor = _factor(e, longest, most)
        channels = e.model.drive.reference_channels(e.model.arm)
        part = _part(e, thinned(e.recording, factor, channels), most)
        try:
            found.append(prepare(e.model, part, e.outputs, e.processing))
        except InputError:
            return None  # nothing of it counts: the search takes all samples
        by.append(factor)
    return Shortened(tuple(found), tuple(by), _note(experiments, found, by))


def _factor(e: Prepared, longest: float, most: int) -> int:
    """None is left out where few are there, or where the scenario thins the outputs itself."""
    N = len(e.recording.time)
    if e.processing.decimate > 1 or most >= N:
        return 1
    channels = e.model.drive.reference_channels(e.model.arm)
    stepping = channels if e.model.steering is None else ()
    enough = N / most * e.recording.sample_time  # no more is left out than has to be
    return largest_factor(e.recording, stepping, min(longest, 2.0 * enough))


def _longest_sample_time(
    experiments: Sequence[Prepared], unknowns: Unknowns, fixed: Mapping[str, float]
) -> float:
    """s, at which nothing is lost that the answer depends on: the fastest motion that matters,
    a virtual servo's band, stated filters of logger and scenario, and stated delays."""
    rates, delays = [], []
    for e in experiments:
        if e.model.steering is not None:
            rates.append(e.model.steering.hz)
        rates += [one.frequency / (2.0 * np.pi) for one in e.recording.logger_filters.values()]
        rates += [one.cutoff_hz for kind in {*e.kinds} for one in e.processing.filters(kind)]
        delays += [e.recording.camera.delay] if e.recording.camera.delay else []
        delays += _stated_delays(e)
    if all(e.model.steering is None for e in experiments):
        rates.append(STIFFER * _fastest(experiments, unknowns, fixed))
    between = delays or any(e.recording.logger_filters for e in experiments)
    samples = PER_PERIOD_BETWEEN if between else PER_PERIOD
    return min([1.0 / (samples * max(rates)), *map(abs, delays)])


def _stated_delays(e: Prepared) -> list[float]:
    """s, of effects between a sensor and its file."""
    model, sizes = e.model, typical(e.model.arm)
    late = [one for one in model.effects if type(one).sensed is not Effect.sensed]
    found = [
        effect_parameter.parameter
        for one in late
        for effect_parameter in one.parameters(model.arm, model.drive, sizes)
    ]
    values = (abs(model.effect_values.get(p.name, 0.0)) for p in found if p.unit == "s")
    return [value for value in values if value > 0.0]


def _fastest(
    experiments: Sequence[Prepared], unknowns: Unknowns, fixed: Mapping[str, float]
) -> float:
    """Hz, below which nearly all lies that the outputs tell about each parameter: the power of
    its sensitivity, at the start and along the beginning of each recording."""
    most = max(MOST_SAMPLES // len(experiments), FEWEST_SAMPLES)
    recordings = [first_part(e.recording, most) for e in experiments]
    parts = [
        prepare(e.model, r, e.outputs, Processing())
        for e, r in zip(experiments, recordings, strict=True)
    ]
    predictor = Predictor(parts, unknowns, fixed, steps=1)
    start, scales = unknowns.parameters.vector(), unknowns.parameters.scales()
    weights, found = channel_weights(parts, {}), 0.0
    searched = [j for j, item in enumerate(unknowns.items) if item.searched]
    moved = [start + MOVED * scales[j] * (np.arange(len(start)) == j) for j in searched]
    whole = range(len(parts))
    at, *sides = predictor.predict_many([(vector, whole) for vector in (start, *moved)])
    for side in sides:
        for e, y, y0, w in zip(parts, side, at, weights, strict=True):
            found = max(found, _band((y - y0) * w) / e.recording.sample_time)
    return found or 0.5 / min(e.recording.sample_time for e in experiments)


MOVED = 1e-4
"""Of a parameter's scale, for its sensitivity."""


def _band(x: np.ndarray) -> float:
    """Cycles per sample below which all but LEFT_ABOVE of the power of x (N, k) lies."""
    N = len(x)
    taper = np.hanning(N)[:, None]  # or the ends would be a step, which has power everywhere
    power = np.sum(np.abs(np.fft.rfft(x * taper, axis=0)) ** 2, axis=1)
    if not np.isfinite(power).all() or not power.any():
        return 0.0
    below = np.cumsum(power) / np.sum(power)
    return float(np.searchsorted(below, 1.0 - LEFT_ABOVE)) / N


def _part(e: Prepared, recording: Recording, most: int) -> Recording:
    """At most that many samples of a motion: the first, a rest before it aside; of a rigid arm
    that a servo holds those in which it moves most, as it can begin anywhere."""
    arm = e.model.arm
    if e.model.steering is not None and arm.coordinates == arm.joints:
        return recording.excerpt(most)
    return first_part(recording, _rest(recording, arm.joints) + most)


def _rest(recording: Recording, joints: int) -> int:
    """Samples before the first joint moves."""
    begun = []
    for k in range(joints):
        if recording.has(f"theta{k + 1}"):
            x = recording[f"theta{k + 1}"]
            moved = np.flatnonzero(np.abs(x - x[0]) > AT_REST * np.ptp(x))
            begun += [int(moved[0])] if len(moved) else []
    return min(begun, default=0)


def _note(experiments: Sequence[Prepared], parts: Sequence[Prepared], by: Sequence[int]) -> str:
    """One line."""
    samples = sum(len(e.recording.time) for e in experiments)
    kept = sum(len(e.recording.time) for e in parts)
    how = []
    factor = max(by)
    if factor > 1:
        dt = experiments[list(by).index(factor)].recording.sample_time
        how.append(f"every sample number {factor} was kept after {sentence(factor, dt)}")
    if any(len(e.recording.time) * h < len(one.recording.time)
           for e, h, one in zip(parts, by, experiments, strict=True)):  # fmt: skip
        how.append("a part of each recording was taken")
    return (
        f"The search worked on {kept:,} of {samples:,} samples ({'; '.join(how)}); the last "
        f"refinement, the estimates and their deviations are from all samples."
    )
