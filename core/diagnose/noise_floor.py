"""Below what an error says nothing about the model: the noise, and what a model may miss at all.

The noise comes from the best source there is: what does not repeat when a motion is made again,
else what is stated of the sensors, else their own high band. The last two are noise of the columns
as they were written, and go the way of the measurement: logger, differentiation, servo, filters,
decimation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..diagnose.output_noise import noise_in_outputs
from ..diagnose.remaining_error import channel_rms
from ..diagnose.repeated_motions import repeated, scatter
from ..diagnose.sensor_noise import ESTIMATED
from ..identify.predictor import Motion
from ..identify.prepared import Prepared

REPETITION = "repetition"

WITHIN = 1.5
"""Factor within which an estimated noise is the true one (tests/diagnose/test_noise_floor.py).
Stated noise counts as exact, and so does noise from repeated motions, which have many samples."""


@dataclass(frozen=True)
class Floor:
    """Of one channel, SI."""

    value: float
    """rms below which an error says nothing: noise and fidelity"""
    noise: float
    source: str
    """Where the noise comes from: repetition, stated or estimated"""
    within: float = 1.0
    """The factor within which it is known"""
    ratios: tuple[float, ...] = ()
    """Of the floor in each recording to this value"""


def channel_floors(
    experiments: Sequence[Prepared],
    errors: Sequence[np.ndarray],
    motions: Sequence[Motion],
    stated: Mapping[str, float],
    fidelity: float,
) -> dict[str, Floor]:
    """channel -> its floor over all recordings.

    `errors` (M, k) per recording, measured minus model, of the fitted `motions`; `stated` standard
    deviations by column of a recording, as the sensor writes it; `fidelity` the share of a
    channel's spread that no model of this kind is asked to explain. What the model leaves
    refutes an estimated noise that is more than WITHIN times as large.
    """
    again = scatter(repeated(experiments), experiments, errors)
    drawn = noise_in_outputs(experiments, motions, stated, without=again)
    left = channel_rms(experiments, errors)
    found = {}
    for name, spread in _spreads(experiments).items():
        alike = (1.0,) * len(experiments)
        noise, source, ratios = (again[name], REPETITION, alike) if name in again else drawn[name]
        noise = min(noise, WITHIN * left[name]) if source == ESTIMATED else noise
        beside = fidelity * spread
        value = float(np.hypot(noise, beside)) or 1e-12
        own = [float(np.hypot(noise * ratio, beside)) / value for ratio in ratios]
        within = WITHIN if source == ESTIMATED else 1.0
        found[name] = Floor(value, noise, source, within, alike if ratios == alike else tuple(own))
    return found


def _spreads(experiments: Sequence[Prepared]) -> dict[str, float]:
    """channel -> rms of its measurement about each recording's mean."""
    return channel_rms(experiments, [e.measured - _mean(e) for e in experiments])


def _mean(e: Prepared) -> np.ndarray:
    """(k,) of the samples that count."""
    total = np.sum(e.measured, axis=0, where=e.counted)
    return np.asarray(total / np.maximum(e.counted.sum(axis=0), 1))
