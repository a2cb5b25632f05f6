"""Noise of the compared outputs, from the noise of the recorded columns.

An encoder's noise is at most what its own past, the other joints and the drive do not predict. A
motion obeys equations: past samples of all joints and drives predict the next position nearly
linearly, whatever the arm and whatever the model lacks. Quantisation noise is new in each sample.
So for any weights a of 1 + LAGS samples of a joint and any of the other signals, the rms of the
weighted sum is at least |a| times the noise. The smallest such ratio is a singular value of the
lagged samples with the other signals projected out (total least squares): an upper bound that needs
no model.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..bounded_cache import BoundedCache, digest
from ..identify.predictor import Motion
from ..identify.prepared_recording import Prepared
from ..identify.setup import Setup
from ..noise.noise_propagation import NoisePath
from ..noise.sensor_noise import (
    ESTIMATED,
    NORMAL_MAD,
    STATED,
    ColumnNoise,
    common_quantisation_step,
    estimate_noise,
    noise_ratios,
    quietest_stretches,
    with_ar_coefficient,
)
from ..recording.initial_motion import FEWEST_PER_COLUMN, LAGS
from ..recording.recording import Recording
from ..recording.visible_band import visible_band
from ..scenario.schema import Scenario
from ..sensors import sensors

NARROW_BAND = 0.25 * np.pi
"""rad per sample: a logger with a narrower band leaves only the motion's own band."""

MOST_OVER_QUANTISATION = 5.0
"""Largest ratio to quantisation noise for an encoder that counts. Above it the steps are the last
digits of a file, and the noise may be correlated and so predictable."""


class ChannelNoise(NamedTuple):
    """Noise of one output."""

    level: float
    """rms over all recordings, SI"""
    source: str
    ratios: tuple[float, ...]
    """Noise in each recording over that level; all one if the recordings agree."""
    least: float
    """rms of the quietest draw."""


def output_noise(
    experiments: Sequence[Prepared], motions: Sequence[Motion], stated: Mapping[str, float],
    excluded: Collection[str] = (),
) -> dict[str, ChannelNoise]:  # fmt: skip
    """channel -> its noise; `excluded` some channels."""
    paths = [NoisePath(e, *m) for e, m in zip(experiments, motions, strict=True)]
    column_noise = _column_noise(paths, stated)
    drawn: dict[str, list[list[np.ndarray]]] = {}
    sources: dict[str, set[str]] = {}
    differ = any(columns_i != column_noise[0] for columns_i in column_noise)
    for i, path in enumerate(paths):
        feeding = [(c.name, s) for s in path.outputs for c in s.channels(path.arm)]
        if all(name in excluded for name, _ in feeding):
            continue
        for (name, s), of_channel in zip(feeding, path.noise(column_noise[i], i), strict=True):
            drawn.setdefault(name, []).append(of_channel)
            columns = [column_noise[i][c] for c in path.source_columns(s) if c in column_noise[i]]
            sources.setdefault(name, set()).update(noise.source for noise in columns)
    scatters = any(path.servo_driven for path in paths)
    noises = dict[str, ChannelNoise]()
    for name, parts in drawn.items():
        draws_rms = np.array([_rms(np.concatenate(draw)) for draw in zip(*parts, strict=True)])
        level = _level_of(draws_rms, scatters)
        ratios = (1.0,) * len(paths)
        if differ and level and len(parts) == len(paths):
            whole = _rms(np.concatenate([x for draws in parts for x in draws]))
            ratios = tuple(_rms(np.concatenate(draws)) / whole or 1.0 for draws in parts)
        noises[name] = ChannelNoise(
            level, _source(sources[name]), ratios, float(draws_rms.min(initial=level))
        )
    return noises


def own_noise(
    experiments: Sequence[Prepared], motions: Sequence[Motion], stated: Mapping[str, float]
) -> dict[str, float]:
    """channel -> rms of the noise that its own columns show: their unpredictable part and their
    steps. What encoders shake through a virtual servo comes on top."""
    paths = [NoisePath(e, *m) for e, m in zip(experiments, motions, strict=True)]
    drawn: dict[str, list[np.ndarray]] = {}
    for i, (path, columns) in enumerate(zip(paths, _column_noise(paths, stated), strict=True)):
        e = path.experiment
        for noise in path.own_noise(columns, i):
            for k, (name, _) in enumerate(e.channels):
                drawn.setdefault(name, []).append(noise[e.counted[:, k], k])
    return {name: _rms(np.concatenate(parts)) for name, parts in drawn.items()}


def simulate_noise(
    experiments: Sequence[Prepared], motions: Sequence[Motion], stated: Mapping[str, float],
    least: int = 1,
) -> list[list[np.ndarray]]:  # fmt: skip
    """Per recording draws (M, k) of the noise in its outputs, zero where nothing counts; at least
    `least` for all recordings together."""
    each = -(-least // len(experiments))
    paths = [NoisePath(e, *m) for e, m in zip(experiments, motions, strict=True)]
    column_noise = _column_noise(paths, stated)
    return [
        [np.where(e.counted & np.isfinite(x), x, 0.0) for x in path.draws(column_noise[i], i, each)]
        for i, (e, path) in enumerate(zip(experiments, paths, strict=True))
    ]


def _level_of(each: np.ndarray, scatters: bool) -> float:
    """rms of draws of these rms (D,) over all recordings; if it scatters from draw to draw, plus
    one standard deviation: an upper quantile of six noise simulations.

    Encoder noise excites lightly damped links for the whole recording, so long recordings hold few
    independent values of it.
    """
    level = float(np.sqrt(np.mean(each**2)))
    return level + float(np.std(each, ddof=1)) if scatters else level


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2))) if x.size else 0.0


def _source(sources: Collection[str]) -> str:
    return STATED if set(sources) == {STATED} else ESTIMATED


def _column_noise(
    paths: Sequence[NoisePath], stated: Mapping[str, float]
) -> list[dict[str, ColumnNoise]]:
    """Per recording: column -> its noise, for all columns that an output comes from."""
    wanted = dict.fromkeys(
        c for r in paths for s in r.experiment.outputs for c in r.source_columns(s)
    )
    noises = _servo_encoder_noise(paths, wanted, stated)
    ratios: dict[str, dict[int, float]] = {}
    for name in wanted:
        if name in noises:
            continue
        recorded = [r for r in paths if r.recording.has(name)]
        limit = min((r.logger_band(name) for r in recorded), default=np.pi)
        is_narrow = limit < NARROW_BAND
        quantum = common_quantisation_step([r.recording[name] for r in recorded])
        stretches = [r.residual_stretches(name, undo=not is_narrow) for r in recorded]
        level = _level(recorded, name, stated)
        if level is None and not quantum and not any(r.servo_driven for r in recorded):
            times = noise_ratios(stretches)
            ratios[name] = {id(r): x for r, x in zip(recorded, times, strict=True)}
            stretches = [[x / t for x in own] for own, t in zip(stretches, times, strict=True)]
        pieces = quietest_stretches([piece for own in stretches for piece in own], quantum)
        if any(r.is_commanded(name) for r in recorded):
            noises[name] = ColumnNoise(0.0, source=ESTIMATED)
            continue
        if level is not None:
            plain = ColumnNoise(level, quantum=quantum)
            noises[name] = plain if is_narrow else with_ar_coefficient(plain, pieces, limit)
            continue
        estimate = estimate_noise(pieces, np.pi if is_narrow else limit) or ColumnNoise(
            0.0, source=ESTIMATED
        )
        noises[name] = replace(_without_quantisation(estimate, quantum), after_logger=is_narrow)
    noises = {name: _limited_by_prediction(paths, name, noise) for name, noise in noises.items()}
    noises = {name: _limited_by_feedback(paths, name, noise) for name, noise in noises.items()}
    return [
        {
            name: replace(noise, std=noise.std * ratios.get(name, {}).get(id(r), 1.0))
            for name, noise in noises.items()
        }
        for r in paths
    ]


def _limited_by_prediction(
    paths: Sequence[NoisePath], name: str, noise: ColumnNoise
) -> ColumnNoise:
    """The noise of a column; of an encoder that counts, at most the unpredicted part.

    Both are upper bounds. Missing friction and ripples also have high frequencies, and once hid
    behind five times the noise; this bound needs no model.
    """
    recorded = [r for r in paths if r.recording.has(name) and name in r.places]
    fed_back = any(r.servo_driven for r in recorded)
    if (
        noise.source != ESTIMATED
        or not noise.quantum
        or noise.ar_coefficient
        or not recorded
        or fed_back
    ):
        return noise
    others = [n for n in (*recorded[0].places, *recorded[0].references) if n != name]
    most = white_noise_bound([r.recording for r in recorded], name, others)
    counts = noise.quantum / np.sqrt(12.0)
    if (
        most is None
        or most > MOST_OVER_QUANTISATION * counts
        or most >= np.hypot(noise.std, counts)
    ):
        return noise
    return _without_quantisation(replace(noise, std=most), noise.quantum)


def _limited_by_feedback(paths: Sequence[NoisePath], name: str, noise: ColumnNoise) -> ColumnNoise:
    """The noise of a column; of a torque that drives a rig, at most the part that the encoders do
    not predict: a controller that feeds them back writes their noise into its commands, and the
    arm follows these."""
    driven = [r for r in paths if r.servo_driven and name in r.references and r.recording.has(name)]
    if noise.source != ESTIMATED or not driven:
        return noise
    most = white_noise_bound([r.recording for r in driven], name, driven[0].places)
    return noise if most is None else replace(noise, std=min(noise.std, most))


def _without_quantisation(noise: ColumnNoise, quantum: float) -> ColumnNoise:
    """The estimate without quantisation noise, if the sensor moves through many steps."""
    variance = max(noise.std**2 - quantum**2 / 12.0, 0.0)
    return replace(noise, std=float(np.sqrt(variance)), quantum=quantum)


def _level(paths: Sequence[NoisePath], name: str, stated: Mapping[str, float]) -> float | None:
    return next((x for r in paths if (x := r.stated(name, stated)) is not None), None)


def _servo_encoder_noise(
    paths: Sequence[NoisePath], wanted: Collection[str], stated: Mapping[str, float]
) -> dict[str, ColumnNoise]:
    """column -> noise of the encoders that a virtual servo follows, from their spectra above the
    motion, and at most what their own past and the other encoders do not predict. Links that are
    hardly damped vibrate above any motion; a torque that is fed back would predict noise too."""
    driven = [r for r in paths if r.servo_driven and r.experiment.model.drive.torque_known]
    noises = {}
    for name in dict.fromkeys(n for r in driven for n in r.places if n in wanted):
        recorded = [r for r in driven if r.recording.has(name)]
        filtered = any(r.recording.logger_filters.get(name) for r in recorded)
        if filtered or _level(recorded, name, stated) is not None:
            continue
        quantum = common_quantisation_step([r.recording[name] for r in recorded])
        band = visible_band([(r.recording[name], r.recording.sample_time) for r in recorded])
        own_level = _noise_by_column_alone(recorded, name, quantum)
        level = own_level if band is None or band.whole else min(band.noise, own_level)
        others = [n for n in recorded[0].places if n != name]
        most = white_noise_bound([r.recording for r in recorded], name, others)
        level = level if most is None else min(level, most)
        noises[name] = _without_quantisation(ColumnNoise(level, source=ESTIMATED), quantum)
    return noises


def _noise_by_column_alone(paths: Sequence[NoisePath], name: str, quantum: float) -> float:
    """Upper bound of a column's noise, from the column alone."""
    columns = [r.recording[name] for r in paths]
    estimate = estimate_noise(quietest_stretches([x[np.isfinite(x)] for x in columns], quantum))
    return np.inf if estimate is None else estimate.std


def stated_noise(
    scenario: Scenario, setup: Setup, recordings: Sequence[Recording]
) -> dict[str, float]:
    """column -> stated standard deviation as the sensor writes it, SI.

    What is computed from other channels (velocities from tip places), or has noise of a stated
    ratio to its signal, has no stated level. That of a current is stated by its torque.
    """
    relative = any(r.simulate and r.simulate.snr_db is not None for r in scenario.recordings)
    levels: dict[str, float] = {}
    for kind, item in sensors().items():
        level = scenario.sensors.noise_of(item.noise)
        if level is None or (relative and kind in ("z", "ydot")):
            continue
        for name in (channel.name for channel in item.channels(setup.model.arm)):
            current = kind == "torque" and all(r.has(f"i{name[1:]}") for r in recordings)
            if current or all(r.has(name) for r in recordings):
                levels[name] = level
    return levels


MOST_NOISE_SAMPLES = 4000
"""Samples of all recordings together; a standard deviation from 4000 is good to a hundredth."""

MOST_RECORDINGS = 16
"""Recordings used: the encoder is the same in all, and each needs enough samples in a row."""


_BOUNDS = BoundedCache[float | None](64)
"""No model changes them, and a noise is estimated again with every better model."""


def white_noise_bound(
    recordings: Sequence[Recording], name: str, others: Sequence[str]
) -> float | None:
    """Upper bound of the standard deviation of white noise in a column, quantisation included; None
    if the recordings are too short. `others`: joints and drives.

    The bound holds for all recordings together and for each alone: a slow one shows less of ripples
    and friction, which no linear equation predicts.
    """
    usable = [r for r in recordings if r.has(name, *others) and _complete(r, [name, *others])]
    usable = usable[:MOST_RECORDINGS]
    if not usable:
        return None

    def least_bound() -> float | None:
        bounds = [_noise_bound(usable, name, others, 1)]
        if len(usable) > 1:
            bounds += [_noise_bound([r], name, others, len(usable)) for r in usable]
        return min((x for x in bounds if x is not None), default=None)

    used = [r[n][:MOST_NOISE_SAMPLES] for r in usable for n in (name, *others)]
    return _BOUNDS.get((*map(len, used), digest(*used)), least_bound)


def _noise_bound(
    recordings: Sequence[Recording], name: str, others: Sequence[str], chosen_of: int
) -> float | None:
    """The bound from some recordings, as the smallest of `chosen_of`; None if they are too
    short."""
    each = MOST_NOISE_SAMPLES // len(recordings)
    lags = np.vstack([_lagged(r[name][:each]) for r in recordings])
    other_lags = [np.vstack([_lagged(r[n][:each]) for r in recordings]) for n in others]
    predictors = np.hstack([np.ones((len(lags), 1)), *other_lags])
    free = len(lags) - predictors.shape[1]
    if free < FEWEST_PER_COLUMN * lags.shape[1]:
        return None
    scales = np.maximum(np.linalg.norm(predictors, axis=0), 1e-300)
    # The singular vectors by way of the small triangle.
    orthogonal, triangle = np.linalg.qr(predictors / scales)
    base, sizes, _ = np.linalg.svd(triangle)
    base = orthogonal @ base[:, sizes > 1e-12 * sizes[0]]
    unexplained = lags - base @ (base.T @ lags)
    combination = unexplained @ np.linalg.svd(np.linalg.qr(unexplained, "r"))[2][-1]
    # The median is not moved by the few instants at which a dry friction turns.
    middle = float(np.median(np.abs(combination))) / NORMAL_MAD
    level = min(float(np.sqrt(np.mean(combination**2))), middle) * np.sqrt(len(combination) / free)
    # The least of several deviations of noise alone lies below it by chance: at most, on average,
    # sqrt(2 ln n) of their own deviations 1 / sqrt(2 free).
    level *= 1.0 + np.sqrt(np.log(chosen_of) / free)
    # The least singular value of white noise alone (Marchenko and Pastur, 1967).
    return float(level / (1.0 - np.sqrt(lags.shape[1] / free)))


def _complete(recording: Recording, names: Sequence[str]) -> bool:
    return all(np.isfinite(recording[n]).all() for n in names) and len(recording.time) > LAGS


def _lagged(x: np.ndarray) -> np.ndarray:
    """(N - LAGS, 1 + LAGS) of x (N,)."""
    return np.lib.stride_tricks.sliding_window_view(x, LAGS + 1)
