"""The noise floor of each channel: below it an error says nothing about the model.

The noise comes from the best source: motions that repeat, else stated sensor noise, else the
sensors' high frequencies. The last two are noise of recorded columns. It is propagated through
logger, differentiation, servo, filters and decimation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..identify.predictor import Motion
from ..identify.prepared_recording import Prepared
from ..noise.output_noise import output_noise, own_noise
from ..noise.repeated_motions import repeated_groups, unrepeated_rms
from ..noise.sensor_noise import ESTIMATED
from ..results import ABOVE_IN_ONE

REPETITION, COLUMN = "repetition", "column"

UNCERTAINTY = 1.5
"""Factor within which an estimated noise is the true one (tests/noise/test_noise_floor.py).
Stated noise counts as exact, and so does noise from repeated motions, which have many samples."""

REFUTED = ABOVE_IN_ONE * UNCERTAINTY
"""Ratio of two noises from which on they contradict each other, though one is an estimate."""


@dataclass(frozen=True)
class Floor:
    """Noise floor of one channel, SI."""

    value: float
    """rms below which an error says nothing: noise and modelling tolerance."""
    noise: float
    source: str
    """Source of the noise: repetition, stated, estimated, or what the column alone shows."""
    uncertainty: float = 1.0
    """Factor within which it is known."""
    ratios: tuple[float, ...] = ()
    """Floor of each recording over this value."""
    refuted: float | None = None
    """An estimate of the noise that the residual refutes, SI: then the noise is not known, and the
    residual stands in its place."""


def channel_floors(
    experiments: Sequence[Prepared], errors: Sequence[np.ndarray], motions: Sequence[Motion],
    stated: Mapping[str, float], fidelity: float,
) -> dict[str, Floor]:  # fmt: skip
    """channel -> its noise floor over all recordings.

    `errors` (M, k) per recording, measured minus model, of the fitted `motions`; `stated` standard
    deviations by column, as the sensor writes them; `fidelity`: relative modelling tolerance, as a
    share of a channel's spread. A residual refutes estimated noise that is more than REFUTED times
    as large. Then the noise is what the channel's own columns show, if that explains the residual;
    else it is not known.
    """
    repeated_noise = unrepeated_rms(repeated_groups(experiments), experiments, errors)
    drawn = output_noise(experiments, motions, stated, excluded=repeated_noise)
    residual_rms = channel_rms(experiments, errors)
    too_large = {
        n for n, x in drawn.items()
        if n not in repeated_noise and x.source == ESTIMATED
        and x.least > REFUTED * residual_rms.get(n, np.inf)
    }  # fmt: skip
    shown = own_noise(experiments, motions, stated) if too_large else {}
    floors = {}
    for name, spread in spreads(experiments).items():
        equal = (1.0,) * len(experiments)
        repeated = repeated_noise.get(name)
        noise, source, ratios, _ = (
            drawn[name] if repeated is None else (repeated, REPETITION, equal, repeated)
        )
        allowance, refuted = fidelity * spread, None
        if name in too_large:
            left = residual_rms[name]
            if left <= REFUTED * shown[name] and shown[name] <= REFUTED * left:
                noise, source = shown[name], COLUMN
            else:
                # Within the modelling tolerance nothing can be missing, whatever the noise is.
                refuted = noise if left > allowance else None
                noise = left
        value = float(np.hypot(noise, allowance)) or 1e-12
        in_recordings = [float(np.hypot(noise * ratio, allowance)) / value for ratio in ratios]
        factor = UNCERTAINTY if source in (ESTIMATED, COLUMN) else 1.0
        floors[name] = Floor(
            value, noise, source, factor, equal if ratios == equal else tuple(in_recordings),
            refuted,
        )  # fmt: skip
    return floors


def squares_by_channel(
    experiments: Sequence[Prepared], errors: Sequence[np.ndarray]
) -> dict[str, np.ndarray]:
    """channel -> its squared errors in noise floors, at the samples that count."""
    squares: dict[str, list[np.ndarray]] = {}
    for e, r in zip(experiments, errors, strict=True):
        for k, (name, _) in enumerate(e.channels):
            if e.counted[:, k].any():
                squares.setdefault(name, []).append(r[e.counted[:, k], k] ** 2)
    return {name: np.concatenate(parts) for name, parts in squares.items()}


def channel_rms(experiments: Sequence[Prepared], errors: Sequence[np.ndarray]) -> dict[str, float]:
    """channel -> rms of errors (M, k) per recording, at the samples that count."""
    squares = squares_by_channel(experiments, errors)
    return {name: float(np.sqrt(np.mean(x))) for name, x in squares.items()}


def spreads(experiments: Sequence[Prepared]) -> dict[str, float]:
    """channel -> rms of its measurement about each recording's mean, SI."""
    return channel_rms(experiments, [e.measured - _mean(e) for e in experiments])


def _mean(e: Prepared) -> np.ndarray:
    """(k,) of the samples that count."""
    total = np.sum(e.measured, axis=0, where=e.counted)
    return np.asarray(total / np.maximum(e.counted.sum(axis=0), 1))
