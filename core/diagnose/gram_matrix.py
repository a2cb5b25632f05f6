"""The Gram matrix of residual, nuisance and candidates, which answers every linear question.

For the columns C = [S G r], one (P + Q + 1)^2 matrix per recording gives projections, scores,
angles between candidates and hold-outs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from ..least_squares import SEEN

NO_OUTPUT = 1e-20
"""In squared noise floors: a column that changes no output."""


@dataclass(frozen=True)
class GramMatrix:
    """Inner products over recordings; nuisance first, then columns, the residual last."""

    parts: np.ndarray
    """(recordings + 1, P + Q + 1, P + Q + 1); the last is what is known a priori"""
    nuisance: int

    @property
    def total(self) -> np.ndarray:
        """(P + Q + 1, P + Q + 1) of all recordings together."""
        return np.asarray(self.parts.sum(axis=0))

    def without(self, i: int) -> GramMatrix:
        """The matrix without one recording."""
        return GramMatrix(np.delete(self.parts, i, axis=0), self.nuisance)

    def projected(self) -> np.ndarray:
        """(Q + 1, Q + 1): inner products of columns and residual, nuisance projected out."""
        P, C = self.nuisance, self.total
        if not P:
            return C
        size = np.diag(C)[:P]
        d = np.where(size > NO_OUTPUT, np.sqrt(np.maximum(size, NO_OUTPUT)), np.inf)
        values, vectors = np.linalg.eigh(C[:P, :P] / np.outer(d, d))
        kept = values > SEEN * values.max()
        half = (vectors[:, kept] / np.sqrt(values[kept])).T @ (C[:P, P:] / d[:, None])
        return np.asarray(C[P:, P:] - half.T @ half)


def gram_matrix(
    residuals: Sequence[np.ndarray], slopes: Sequence[np.ndarray],
    columns: Sequence[Sequence[np.ndarray]], whiten: Callable[[int, np.ndarray], np.ndarray],
    prior: tuple[np.ndarray, np.ndarray] | None = None,
) -> GramMatrix:  # fmt: skip
    """The matrix of residuals (M, k), nuisance slopes (M, k, P) and columns (M, k) per recording.

    `prior`: errors and slopes (P,) of what is known a priori of the nuisance, as measurements.

    Slopes are those of errors, columns those of outputs; both become directions of the outputs.
    `whiten` takes a recording's number and a block (M, k, ...) and returns (K, ...).
    """
    parts = []
    for i, r in enumerate(residuals):
        own = np.stack([c[i] for c in columns], axis=-1) if columns else r[..., None][..., :0]
        both = np.concatenate([-slopes[i], own, r[..., None]], axis=-1)
        flat = whiten(i, both)
        parts.append(flat.T @ flat)
    P = slopes[0].shape[2]
    errors, sizes = prior or (np.zeros(P), np.zeros(P))
    known = np.column_stack([np.diag(-sizes), np.zeros((P, len(columns))), errors])
    return GramMatrix(np.array([*parts, known.T @ known]), P)


@dataclass(frozen=True)
class Explained:
    """What some columns explain of the residual."""

    cost_reduction: float
    """Reduction of the squared error."""
    coefficients: np.ndarray
    """(m,) by which the columns are multiplied."""


def explained_by(
    projected: np.ndarray, which: Sequence[int], one_sided: Sequence[bool]
) -> Explained:
    """Least squares on some columns `projected` (Q + 1, Q + 1), with fixed signs for one-sided ones
    (Lawson and Hanson 1974)."""
    at = list(which)
    if not at:
        return Explained(0.0, np.zeros(0))
    A, b = projected[np.ix_(at, at)], projected[at, -1]
    if len(at) == 1:  # most questions are of one column, and need no solver
        size = float(A[0, 0])
        factor = float(b[0]) / size if size > NO_OUTPUT else 0.0
        factor = max(factor, 0.0) if one_sided[0] else factor
        return Explained(factor**2 * size, np.array([factor]))
    nonzero = np.diag(A) > NO_OUTPUT
    d = np.where(nonzero, np.sqrt(np.maximum(np.diag(A), NO_OUTPUT)), np.inf)
    normal = A / np.outer(d, d) + 1e-12 * np.eye(len(at))
    values, vectors = np.linalg.eigh(normal)  # rounding can leave a tiny negative one
    roots = np.sqrt(np.maximum(values, 0.0) + 1e-9)
    right = (vectors / roots).T @ (b / d)
    x = _signed_least_squares(roots[:, None] * vectors.T, right, one_sided)
    reduction = float(2.0 * x @ (b / d) - x @ normal @ x)
    return Explained(max(reduction, 0.0), x / d)


def _signed_least_squares(
    F: np.ndarray, right: np.ndarray, one_sided: Sequence[bool]
) -> np.ndarray:
    """argmin |F x - right| with x_i >= 0 where one-sided: a free entry is two that are not."""
    free = [i for i, fixed in enumerate(one_sided) if not fixed]
    wide = np.hstack([F, -F[:, free]])
    solution = np.maximum(scipy.optimize.nnls(wide, right)[0], 0.0)  # it may round below zero
    x = solution[: F.shape[1]].copy()
    x[free] -= solution[F.shape[1] :]
    return np.asarray(x)
