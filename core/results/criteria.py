"""What is kept of a model's errors to choose among models of the same recordings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ErrorProducts:
    """The errors of a model as inner products of neighbouring samples: enough to whiten them by the
    noise of any other model."""

    products: np.ndarray
    """(channels, n, n) sums over the samples, in squares of the channels' SI units; the first row
    is the sample itself, the next ones those before it"""
    samples: np.ndarray
    """(channels,) with so many samples before them"""
    variance: np.ndarray
    """(channels,) of what was measured, in squares of the same units"""
    parameters: int
    """That were estimated, those of single recordings too."""
    prior: float = 0.0
    """Squared distance from what is known a priori, in its deviations."""


@dataclass(frozen=True)
class InformationCriteria:
    """Of one model; differences between models of the same recordings count, the smaller the
    better. Errors are whitened by one noise, the same for all models that are compared."""

    aic: float
    """Akaike's: -2 ln L + 2 p"""
    bic: float
    """Schwarz's: -2 ln L + p ln N"""
    fpe: float
    """Akaike's final prediction error, one sample ahead, over the variance of what was measured:
    no unit"""
    samples: int
    """N, of all outputs"""
    parameters: int
    """p"""
