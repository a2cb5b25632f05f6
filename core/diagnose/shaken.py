"""Deviations of estimates where the encoders' noise shakes the arm.

Where a servo leads the joints, their noise sets lightly damped links swinging, and they swing for
the whole recording at the frequency by which a stiffness shows. A fit takes most of that up, so the
residual does not tell: three deviations off were no rarity. What the noise does to the estimates is
therefore drawn, with the model's own equations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from core.diagnose.data import Data
from core.diagnose.noise_route import noise_drawn
from core.diagnose.refit import Refit
from core.diagnose.start import motions_of
from core.diagnose.verdict import channel_rms
from core.least_squares import pseudo_inverse

DRAWN = 24
"""Of all recordings together: a variance of so many draws is good to a third, and deviations of it
hold nearly as often as if it were known (2.06 of them for 1.96; of six draws 2.45)."""


def widened(data: Data, refit: Refit, stated: Mapping[str, float]) -> Refit:
    """The fit with deviations that are no smaller than what draws of the noise make of them.

    Args:
        data: recordings along which a servo leads the joints.
        refit: a model at its minimum.
        stated: column -> standard deviation of the sensor's noise, SI, where it is known.
    """
    C = refit.covariance
    known = np.flatnonzero(np.isfinite(np.diag(C)))
    if not len(known):
        return refit
    drawn = _variances(data, refit, known, stated)
    wider = np.ones(len(C))
    wider[known] = np.sqrt(np.maximum(drawn / np.maximum(np.diag(C)[known], 1e-300), 1.0))
    return replace(refit, covariance=C * np.outer(wider, wider))


def _variances(
    data: Data, refit: Refit, known: np.ndarray, stated: Mapping[str, float]
) -> np.ndarray:
    """(p,) of the unknowns `known`: of (S'S)^-1 S'e over draws e, which recordings make apart. A
    channel's draws are at most its floor, where the
    model has shown that its columns are less noisy than they seemed."""
    h = refit.hypothesis
    slopes = [S[:, :, known].reshape(-1, len(known)) for S in refit.descended.slopes]
    inverse = pseudo_inverse(np.asarray(sum(S.T @ S for S in slopes)))
    meat = np.zeros_like(inverse)
    experiments, motions = h.residuals.experiments, motions_of(h)
    drawn = [
        np.array([x * weights for x in draws])
        for draws, weights in zip(
            noise_drawn(experiments, motions, stated, DRAWN), data.weights, strict=True
        )
    ]
    sizes = channel_rms(experiments, [np.sqrt(np.mean(x**2, axis=0)) for x in drawn])
    most = np.array([1.0 / max(sizes.get(n, 0.0), 1.0) for n, _ in experiments[0].channels])
    for S, draws in zip(slopes, drawn, strict=True):
        pulls = np.array([S.T @ (x * most).ravel() for x in draws])
        meat += pulls.T @ pulls / len(pulls)
    return np.diag(inverse @ meat @ inverse)
