"""Noise of encoders and torque of a rig that a recorded torque drives, from the missing torque.

What an encoder reads holds the motion too, and a drive's torque jumps: up to the highest
frequencies the motion answers it, and beyond a low-pass of the encoder there is more motion than
noise. In the torque that is missing (needed by the motion, less recorded) the motion is gone as far
as the model is right, whatever the torque did. Its high band is therefore explained by the noise of
the columns that it is made from: each column's white noise of level one makes a spectrum, drawn and
passed through the same equations, and the levels are the non-negative least squares of the spectra.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy

from core.diagnose.sensor_noise import HIGH, ColumnNoise, spectrum, without_lines
from core.identify.held import points_led
from core.identify.predictor import motion_of
from core.identify.prepared import TORQUE, Prepared, Processing, prepare
from core.model import Numbers
from core.recording.beginning import AT_ONCE
from core.recording.recording import Recording
from core.sensors import sensor

BANDS = 12
"""Of the high band: enough to tell a flat spectrum (torque) from one that grows with the fourth
power of the frequency (encoders), few enough that each averages dozens of ordinates."""

MOST_RECORDINGS = 4
"""A sensor's noise is the same in all; four of a second average a thousand ordinates."""

ROUNDS = 6
"""Of the weights, which are one over the fitted spectrum: they settle after three."""

SEED = 21
"""Of the draws; a noise floor must not change from one look to the next."""

STEPS = 2
"""Per sample, as for the noise floor itself: only what the noise changes counts."""


class MissingTorque:
    """Of one recording at a fitted model, before any filter."""

    def __init__(self, e: Prepared, numbers: Numbers, values: Mapping[str, float]) -> None:
        self._model, self._numbers, self._values = e.model, numbers, values
        self.recording = e.recording

    def of(self, recording: Recording) -> np.ndarray:
        """(M, joints), of the samples that count in every joint."""
        e = prepare(self._model, recording, (sensor(TORQUE),), Processing())
        steps = max(STEPS // points_led(self._model, recording.sample_time), 1)
        motion = motion_of(e, self._numbers, self._values, steps)
        missing = e.predicted(motion, self._numbers, self._values) - e.measured
        return np.asarray(missing[e.counted.all(axis=1)])


def _banded(missing: np.ndarray, lines: bool) -> np.ndarray:
    """(joints, BANDS) mean power per band of a torque (M, joints); `lines`: it may hold some."""
    edges = np.linspace(*HIGH, BANDS + 1)
    powers = []
    for x in missing.T:
        found = spectrum([x])
        found = without_lines(found) if lines else found
        band = np.digitize(found.angle, edges) - 1
        chosen = [found.power[band == b] for b in range(BANDS)]
        powers.append([float(np.mean(x)) if x.size else np.nan for x in chosen])
    return np.array(powers)


def levels(
    missing: Sequence[MissingTorque],
    columns: Sequence[str],
    stated: Mapping[str, ColumnNoise],
    units: Mapping[str, float],
) -> dict[str, float]:
    """column -> standard deviation of its noise, steps included; of the `columns` not `stated`.

    `units`: a level of noise per column, small enough that the model answers it linearly. Empty
    where the recordings are too short for spectra.
    """
    rng = np.random.default_rng(SEED)
    seen, made = [], []
    for one in missing[:MOST_RECORDINGS]:
        plain = one.of(one.recording)
        if not np.isfinite(plain).all():
            continue
        shaken = [one.of(_shaken(one.recording, n, units[n], rng)) for n in columns]
        seen.append(_banded(plain, lines=True))
        made.append([_banded(x - plain, lines=False) for x in shaken])
    if not seen:
        return {}
    power, parts = np.mean(seen, axis=0).ravel(), np.mean(made, axis=0).reshape(len(columns), -1)
    good = np.isfinite(power) & np.isfinite(parts).all(axis=0) & (power > 0.0)
    known = [name for name in columns if name in stated]
    free = [name for name in columns if name not in stated]
    if good.sum() < len(free) or not free:
        return {}
    rows = {name: row[good] for name, row in zip(columns, parts, strict=True)}
    given = sum((_variance(stated[n]) / units[n] ** 2 * rows[n] for n in known), np.zeros(1))
    found = _fitted(power[good], np.array([rows[n] for n in free]).T, given)
    return {n: float(np.sqrt(x)) * units[n] for n, x in zip(free, found, strict=True)}


def _variance(noise: ColumnNoise) -> float:
    return noise.std**2 + noise.step**2 / 12.0


def _shaken(r: Recording, name: str, unit: float, rng: np.random.Generator) -> Recording:
    """The recording with white noise of level `unit` on one column; without any where it is seen
    whether the motion begins at rest."""
    noise = unit * rng.standard_normal(len(r.time))
    noise[:AT_ONCE] = 0.0
    return replace(r, channels={**r.channels, name: r[name] + noise})


def _fitted(power: np.ndarray, parts: np.ndarray, given: np.ndarray) -> np.ndarray:
    """Non-negative weights of parts (B, c) that make up power (B,) beyond what is given.

    Each ordinate scatters by its own size, so all are compared relative to the fitted spectrum.
    """
    fitted = power
    for _ in range(ROUNDS):
        scale = 1.0 / np.maximum(fitted, 1e-6 * power.max())
        weights, _ = scipy.optimize.nnls(
            parts * scale[:, None], np.maximum(power - given, 0.0) * scale
        )
        fitted = parts @ weights + given
    return np.asarray(weights)
