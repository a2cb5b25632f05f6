"""Noise of the recorded columns on its way to the compared outputs.

An encoder's noise is at most what its own past, the other joints and the drive do not predict. A
motion obeys equations: from enough samples before it, of all joints and of what drives them, the
next place of a joint follows nearly linearly, whatever the arm is and whatever the model lacks of
it. What an encoder adds by counting is new in each sample. So for any weights a of 1 + LAGS samples
of a joint, and any of the other signals, the rms of the weighted sum is at least |a| times the
noise. The least such ratio is a singular value of the samples side by side, once the other signals
are projected out of them (total least squares): a bound from above that needs no model.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..diagnose.noise_propagation import Route
from ..diagnose.sensor_noise import (
    ESTIMATED,
    NORMAL_MAD,
    STATED,
    ColumnNoise,
    common_step,
    estimated,
    noise_ratios,
    quietest,
    with_colour,
)
from ..identify.predictor import Motion
from ..identify.prepared import Prepared
from ..identify.setup import Setup
from ..recording.beginning import FEWEST_PER_COLUMN, LAGS
from ..recording.recording import Recording
from ..recording.visible_band import visible_band
from ..scenario.schema import Scenario
from ..sensors import sensors

NARROW = 0.25 * np.pi
"""rad per sample: a logger that lets less through leaves nothing but the motion's own band."""

COUNTED = 5.0
"""Times the noise of counting alone, up to which a column counts: beyond it the steps are the last
digits of a file, and its noise may be coloured, which its own past foretells."""


class ChannelNoise(NamedTuple):
    """Of one output."""

    level: float
    """rms over all recordings, SI"""
    source: str
    ratios: tuple[float, ...]
    """Of the noise in each recording to that level; all one where the recordings agree"""


def noise_in_outputs(
    experiments: Sequence[Prepared],
    motions: Sequence[Motion],
    stated: Mapping[str, float],
    without: Collection[str] = (),
) -> dict[str, ChannelNoise]:
    """channel -> its noise; `without` some channels."""
    routes = [Route(e, *m) for e, m in zip(experiments, motions, strict=True)]
    known = _columns(routes, stated)
    drawn: dict[str, list[list[np.ndarray]]] = {}
    sources: dict[str, set[str]] = {}
    differ = any(one != known[0] for one in known)
    for i, route in enumerate(routes):
        feeding = [(c.name, s) for s in route.outputs for c in s.channels(route.arm)]
        if all(name in without for name, _ in feeding):
            continue
        for (name, s), found in zip(feeding, route.noise(known[i], i), strict=True):
            drawn.setdefault(name, []).append(found)
            columns = [known[i][c] for c in route.feeding(s) if c in known[i]]
            sources.setdefault(name, set()).update(noise.source for noise in columns)
    scatters = any(route.driven for route in routes)
    noises = dict[str, ChannelNoise]()
    for name, parts in drawn.items():
        level = _level_of(parts, scatters)
        ratios = (1.0,) * len(routes)
        if differ and level and len(parts) == len(routes):
            whole = _rms(np.concatenate([x for draws in parts for x in draws]))
            ratios = tuple(_rms(np.concatenate(draws)) / whole or 1.0 for draws in parts)
        noises[name] = ChannelNoise(level, _source(sources[name]), ratios)
    return noises


def noise_drawn(
    experiments: Sequence[Prepared],
    motions: Sequence[Motion],
    stated: Mapping[str, float],
    least: int = 1,
) -> list[list[np.ndarray]]:
    """Per recording draws (M, k) of the noise in its outputs, zero where nothing counts; so many
    at `least` of all recordings together."""
    each = -(-least // len(experiments))
    routes = [Route(e, *m) for e, m in zip(experiments, motions, strict=True)]
    known = _columns(routes, stated)
    return [
        [np.where(e.counted & np.isfinite(x), x, 0.0) for x in route.draws(known[i], i, each)]
        for i, (e, route) in enumerate(zip(experiments, routes, strict=True))
    ]


def _level_of(parts: Sequence[Sequence[np.ndarray]], scatters: bool) -> float:
    """rms over all recordings of the draws of each; where it scatters from draw to draw, what a
    draw exceeds in one of six cases.

    The encoders' noise shakes lightly damped links, which then swing for the whole recording: long
    recordings hold few independent values of such a noise.
    """
    each = np.array([_rms(np.concatenate(draw)) for draw in zip(*parts, strict=True)])
    level = float(np.sqrt(np.mean(each**2)))
    return level + float(np.std(each, ddof=1)) if scatters else level


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2))) if x.size else 0.0


def _source(found: Collection[str]) -> str:
    return STATED if set(found) == {STATED} else ESTIMATED


def _columns(routes: Sequence[Route], stated: Mapping[str, float]) -> list[dict[str, ColumnNoise]]:
    """Per recording column -> its noise, for all columns that any output comes from."""
    wanted = dict.fromkeys(c for r in routes for s in r.experiment.outputs for c in r.feeding(s))
    found = _of_led_encoders(routes, wanted, stated)
    ratios: dict[str, dict[int, float]] = {}
    for name in wanted:
        if name in found:
            continue
        able = [r for r in routes if r.recording.has(name)]
        limit = min((r.logged_to(name) for r in able), default=np.pi)
        narrow = limit < NARROW
        step = common_step([r.recording[name] for r in able])
        apart = [r.beyond_the_model(name, undo=not narrow) for r in able]
        level = _level(able, name, stated)
        if level is None and not step and not any(r.driven for r in able):
            times = noise_ratios(apart)
            ratios[name] = {id(r): x for r, x in zip(able, times, strict=True)}
            apart = [[x / t for x in own] for own, t in zip(apart, times, strict=True)]
        pieces = quietest([piece for own in apart for piece in own], step)
        if any(r.commanded(name) for r in able):
            found[name] = ColumnNoise(0.0, source=ESTIMATED)
            continue
        if level is not None:
            plain = ColumnNoise(level, step=step)
            found[name] = plain if narrow else with_colour(plain, pieces, limit)
            continue
        seen = estimated(pieces, np.pi if narrow else limit) or ColumnNoise(0.0, source=ESTIMATED)
        found[name] = replace(_beside_steps(seen, step), after_logger=narrow)
    found = {name: _counted(routes, name, noise) for name, noise in found.items()}
    return [
        {
            name: replace(noise, std=noise.std * ratios.get(name, {}).get(id(r), 1.0))
            for name, noise in found.items()
        }
        for r in routes
    ]


def _counted(routes: Sequence[Route], name: str, noise: ColumnNoise) -> ColumnNoise:
    """The noise of a column, of an encoder's counts at most what nothing else foretells.

    Both are bounds from above. What a model lacks of friction and ripples stands in the high band
    as well, and hid itself behind five times the noise; no equation is needed here.
    """
    able = [r for r in routes if r.recording.has(name) and name in r.places]
    fed_back = any(r.driven for r in able)
    if noise.source != ESTIMATED or not noise.step or noise.colour or not able or fed_back:
        return noise
    others = [n for n in (*able[0].places, *able[0].references) if n != name]
    most = unforeseen([r.recording for r in able], name, others)
    counts = noise.step / np.sqrt(12.0)
    if most is None or most > COUNTED * counts or most >= np.hypot(noise.std, counts):
        return noise
    return _beside_steps(replace(noise, std=most), noise.step)


def _beside_steps(seen: ColumnNoise, step: float) -> ColumnNoise:
    """Of all that is seen, what the steps do not make where the sensor moves through many."""
    rest = max(seen.std**2 - step**2 / 12.0, 0.0)
    return replace(seen, std=float(np.sqrt(rest)), step=step)


def _level(routes: Sequence[Route], name: str, stated: Mapping[str, float]) -> float | None:
    return next((x for r in routes if (x := r.stated(name, stated)) is not None), None)


def _of_led_encoders(
    routes: Sequence[Route], wanted: Collection[str], stated: Mapping[str, float]
) -> dict[str, ColumnNoise]:
    """column -> its noise, of the encoders along which a virtual servo leads the joints: what their
    spectra show above the motion. The torque that they feed back foretells them, so that nothing
    but they themselves tells."""
    driven = [r for r in routes if r.driven and r.experiment.model.drive.torque_known]
    found = {}
    for name in dict.fromkeys(n for r in driven for n in r.places if n in wanted):
        able = [r for r in driven if r.recording.has(name)]
        filtered = any(r.recording.logger_filters.get(name) for r in able)
        if filtered or _level(able, name, stated) is not None:
            continue
        step = common_step([r.recording[name] for r in able])
        band = visible_band([(r.recording[name], r.recording.sample_time) for r in able])
        itself = _itself(able, name, step)
        level = itself if band is None or band.whole else min(band.noise, itself)
        found[name] = _beside_steps(ColumnNoise(level, source=ESTIMATED), step)
    return found


def _itself(routes: Sequence[Route], name: str, step: float) -> float:
    """Standard deviation of a column's noise at most, by the column alone."""
    columns = [r.recording[name] for r in routes]
    seen = estimated(quietest([x[np.isfinite(x)] for x in columns], step))
    return np.inf if seen is None else seen.std


def stated_noise(
    scenario: Scenario, setup: Setup, recordings: Sequence[Recording]
) -> dict[str, float]:
    """column -> standard deviation as the sensor writes it, SI, where it was stated.

    What is computed from other channels (velocities from tip places), or has noise of a stated
    ratio to its signal, has no stated level. That of a current is stated by its torque.
    """
    relative = any(r.simulate and r.simulate.snr_db is not None for r in scenario.recordings)
    found: dict[str, float] = {}
    for kind, one in sensors().items():
        level = scenario.sensors.noise_of(one.noise)
        if level is None or (relative and kind in ("z", "ydot")):
            continue
        for name in (channel.name for channel in one.channels(setup.model.arm)):
            current = kind == "torque" and all(r.has(f"i{name[1:]}") for r in recordings)
            if current or all(r.has(name) for r in recordings):
                found[name] = level
    return found


MOST_SAMPLES = 4000
"""Of all recordings together; the deviation of 4000 samples is good to a hundredth."""

MOST_RECORDINGS = 16
"""An encoder is the same in all, and of each enough samples in a row are needed."""


def unforeseen(recordings: Sequence[Recording], name: str, others: Sequence[str]) -> float | None:
    """Standard deviation of the white noise in a column, its steps included, at most; None where
    the recordings are too short to say. `others`: joints, and what drives them.

    It holds for all recordings together and for each alone: a calm one tells less of the ripples
    and the friction that no linear equation foretells.
    """
    able = [r for r in recordings if r.has(name, *others) and _complete(r, [name, *others])]
    able = able[:MOST_RECORDINGS]
    if not able:
        return None
    bounds = [_least(able, name, others, 1)]
    if len(able) > 1:
        bounds += [_least([r], name, others, len(able)) for r in able]
    return min((x for x in bounds if x is not None), default=None)


def _least(
    recordings: Sequence[Recording], name: str, others: Sequence[str], chosen_of: int
) -> float | None:
    """The bound from some recordings, the least of so many; None where they are too short."""
    each = MOST_SAMPLES // len(recordings)
    own = np.vstack([_lagged(r[name][:each]) for r in recordings])
    beside = [np.vstack([_lagged(r[n][:each]) for r in recordings]) for n in others]
    known = np.hstack([np.ones((len(own), 1)), *beside])
    free = len(own) - known.shape[1]
    if free < FEWEST_PER_COLUMN * own.shape[1]:
        return None
    scales = np.maximum(np.linalg.norm(known, axis=0), 1e-300)
    base, sizes, _ = np.linalg.svd(known / scales, full_matrices=False)
    base = base[:, sizes > 1e-12 * sizes[0]]
    left = own - base @ (base.T @ own)
    rest = left @ np.linalg.svd(left, full_matrices=False)[2][-1]
    # The median is not moved by the few instants at which a dry friction turns.
    middle = float(np.median(np.abs(rest))) / NORMAL_MAD
    level = min(float(np.sqrt(np.mean(rest**2))), middle) * np.sqrt(len(rest) / free)
    # The least of several deviations of noise alone lies below it by chance: at most, on average,
    # sqrt(2 ln n) of their own deviations 1 / sqrt(2 free).
    level *= 1.0 + np.sqrt(np.log(chosen_of) / free)
    # The least singular value of white noise alone (Marchenko and Pastur, 1967).
    return float(level / (1.0 - np.sqrt(own.shape[1] / free)))


def _complete(recording: Recording, names: Sequence[str]) -> bool:
    return all(np.isfinite(recording[n]).all() for n in names) and len(recording.time) > LAGS


def _lagged(x: np.ndarray) -> np.ndarray:
    """(N - LAGS, 1 + LAGS) of x (N,)."""
    return np.lib.stride_tricks.sliding_window_view(x, LAGS + 1)
