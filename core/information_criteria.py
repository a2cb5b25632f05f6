"""Choice among models of the same recordings: AIC (Akaike 1974), BIC (Schwarz 1978), FPE."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .results import RecordingComparison


@dataclass(frozen=True)
class InformationCriteria:
    """Of one model; differences between models of the same recordings count, the smaller the
    better.

    They take the residuals for white, with a variance of its own for each output. Coloured
    residuals make them too sure, towards larger models: a diagnosis decides by whitened ones.
    """

    aic: float
    """Akaike's: -2 ln L + 2 p"""
    bic: float
    """Schwarz's: -2 ln L + p ln N"""
    fpe: float
    """Akaike's final prediction error, over the variance of what was measured: no unit"""
    samples: int
    """N, of all outputs"""
    parameters: int
    """p"""


def information_criteria(
    comparisons: Sequence[RecordingComparison], parameters: int
) -> InformationCriteria | None:
    """The criteria of a model (Ljung 1999, System Identification, 16.4).

    Args:
        comparisons: Measured against modelled; the fitted outputs of recordings to estimate count.
        parameters: That were estimated.

    Returns:
        None where nothing was compared, or an output has no error or no variance.
    """
    errors: dict[str, list[np.ndarray]] = {}
    measured: dict[str, list[np.ndarray]] = {}
    for recording in (c for c in comparisons if c.role == "estimate"):
        for c in (c for c in recording.channels if c.fitted and c.counted.any()):
            y = c.measured[c.counted]
            errors.setdefault(c.channel, []).append(c.residual[c.counted])
            measured.setdefault(c.channel, []).append(y - y.mean())
    size, own, whole = (
        np.array([f(np.concatenate(parts)) for parts in group.values()])
        for f, group in ((len, errors), (_mean_square, errors), (_mean_square, measured))
    )
    samples = int(np.sum(size))
    if samples <= parameters or not (own > 0.0).all() or not (whole > 0.0).all():
        return None
    twice = float(np.sum(size * (np.log(2.0 * np.pi * own) + 1.0)))
    share = float(np.exp(np.sum(size * np.log(own / whole)) / samples))
    growth = (samples + parameters) / (samples - parameters)
    return InformationCriteria(
        twice + 2.0 * parameters, twice + parameters * float(np.log(samples)), share * growth,
        samples, parameters,
    )  # fmt: skip


def _mean_square(x: np.ndarray) -> float:
    return float(np.mean(x * x))
