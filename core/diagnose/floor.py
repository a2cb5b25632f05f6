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

from core.diagnose.noise_route import noise_in_outputs
from core.diagnose.repetition import repeated, scatter
from core.identify.predictor import Motion
from core.identify.prepared import Prepared

REPETITION = "repetition"


@dataclass(frozen=True)
class Floor:
    """Of one channel, SI."""

    value: float
    """rms below which an error says nothing: noise and fidelity"""
    noise: float
    source: str
    """Where the noise comes from: repetition, stated or estimated"""


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
    channel's spread that no model of this kind is asked to explain.
    """
    again = scatter(repeated(experiments), experiments, errors)
    drawn = noise_in_outputs(experiments, motions, stated, without=again)
    found = {}
    for name, spread in _spreads(experiments).items():
        noise, source = (again[name], REPETITION) if name in again else drawn[name]
        found[name] = Floor(float(np.hypot(noise, fidelity * spread)) or 1e-12, noise, source)
    return found


def _spreads(experiments: Sequence[Prepared]) -> dict[str, float]:
    """channel -> rms of its measurement about each recording's mean; of what counts."""
    parts: dict[str, list[np.ndarray]] = {}
    for e in experiments:
        for k, (name, _) in enumerate(e.channels):
            y = e.measured[e.counted[:, k], k]
            if y.size:
                parts.setdefault(name, []).append(y - y.mean())
    return {name: float(np.sqrt(np.mean(np.concatenate(p) ** 2))) for name, p in parts.items()}
