"""All inner products of residual, nuisance and candidates: every linear question is answered here.

With the columns side by side, C = [S G r], one (P + Q + 1)^2 matrix per recording holds what
projections, scores, angles between candidates and hold-outs need.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

NOTHING = 1e-20
"""In noise floors squared: a column that moves no output."""

RANK = 1e-10
"""Relative eigenvalue below which a direction of the nuisance is not there."""


@dataclass(frozen=True)
class Gram:
    """Inner products over recordings; nuisance first, then columns, the residual last."""

    parts: np.ndarray
    """(recordings, P + Q + 1, P + Q + 1)"""
    nuisance: int

    @property
    def total(self) -> np.ndarray:
        """The Gram matrix of all recordings together."""
        return np.asarray(self.parts.sum(axis=0))

    def without(self, i: int) -> Gram:
        """The same without one recording."""
        return Gram(np.delete(self.parts, i, axis=0), self.nuisance)

    def projected(self) -> np.ndarray:
        """(Q + 1, Q + 1): inner products of columns and residual off the nuisance's span."""
        P, C = self.nuisance, self.total
        if not P:
            return C
        size = np.diag(C)[:P]
        d = np.where(size > NOTHING, np.sqrt(np.maximum(size, NOTHING)), np.inf)
        values, vectors = np.linalg.eigh(C[:P, :P] / np.outer(d, d))
        kept = values > RANK * values.max()
        half = (vectors[:, kept] / np.sqrt(values[kept])).T @ (C[:P, P:] / d[:, None])
        return np.asarray(C[P:, P:] - half.T @ half)


def gram(
    residuals: Sequence[np.ndarray],
    slopes: Sequence[np.ndarray],
    columns: Sequence[Sequence[np.ndarray]],
    whiten: Callable[[int, np.ndarray], np.ndarray],
) -> Gram:
    """From residuals (M, k), nuisance slopes (M, k, P) and columns (M, k) per recording.

    Slopes are of errors, columns of outputs; both are taken as directions of the outputs. `whiten`
    makes samples (K, ...) of a recording's number and block (M, k, ...).
    """
    parts = []
    for i, r in enumerate(residuals):
        own = np.stack([c[i] for c in columns], axis=-1) if columns else r[..., None][..., :0]
        both = np.concatenate([-slopes[i], own, r[..., None]], axis=-1)
        flat = whiten(i, both)
        parts.append(flat.T @ flat)
    P = slopes[0].shape[2]
    return Gram(np.array(parts), P)


@dataclass(frozen=True)
class Explained:
    """What some columns explain of the residual."""

    drop: float
    """Reduction of the squared error."""
    coefficients: np.ndarray
    """(m,) by which the columns are multiplied."""


def explain(projected: np.ndarray, which: Sequence[int], one_sided: Sequence[bool]) -> Explained:
    """Least squares on some of the projected columns, with fixed signs where so said."""
    at = list(which)
    if not at:
        return Explained(0.0, np.zeros(0))
    A, b = projected[np.ix_(at, at)], projected[at, -1]
    there = np.diag(A) > NOTHING
    d = np.where(there, np.sqrt(np.maximum(np.diag(A), NOTHING)), np.inf)
    normal = A / np.outer(d, d) + 1e-12 * np.eye(len(at))
    values, vectors = np.linalg.eigh(normal)  # rounding can leave a tiny negative one
    roots = np.sqrt(np.maximum(values, 0.0) + 1e-9)
    right = (vectors / roots).T @ (b / d)
    x = _signed(roots[:, None] * vectors.T, right, one_sided)
    drop = float(2.0 * x @ (b / d) - x @ normal @ x)
    return Explained(max(drop, 0.0), x / d)


def _signed(F: np.ndarray, right: np.ndarray, one_sided: Sequence[bool]) -> np.ndarray:
    """argmin |F x - right| with x_i >= 0 where one-sided: a free entry is two that are not."""
    free = [i for i, fixed in enumerate(one_sided) if not fixed]
    wide = np.hstack([F, -F[:, free]])
    found, _ = scipy.optimize.nnls(wide, right)
    x = found[: F.shape[1]].copy()
    x[free] -= found[F.shape[1] :]
    return np.asarray(x)
