"""Local linear models made one: common state coordinates, then matrices as polynomials.

A model from a black box has a state of its own choosing, so that two of them cannot be mixed.
Each is first brought to coordinates in which its observability matrix is as near as possible to
that of a reference; then every entry of A, B and C is a polynomial in cos(theta2), fitted by
least squares (J. De Caigny, J. F. Camino and J. Swevers, Interpolation-based modeling of MIMO LPV
systems, IEEE Trans. Control Systems Technology 19, 2011).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from core.montecarlo.subspace import (
    StateSpace,
    identify_subspace,
    respond_all,
    respond_along,
)

DEGREES = (1, 2, 3, 4, 5, 6)
"""Degrees in cos(theta2) that are tried."""

FEWER_STATES = (0, 1, 2)
"""Below the order of the physical model: a mode that drowns in noise is better left out."""

ROWS = 40
"""Block rows of the observability matrices that are compared: 40 ms, the slowest mode's decay."""

Data = tuple[np.ndarray, np.ndarray]
"""u (N, nu) and y (N, ny) of one experiment."""


@dataclass(frozen=True)
class Interpolated:
    """Coefficients (degree + 1, rows, columns) of A, B and C over cos(theta2)."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray

    @property
    def numbers(self) -> int:
        """Entries of all coefficients."""
        return self.A.size + self.B.size + self.C.size

    @property
    def order(self) -> int:
        """Number of states."""
        return self.A.shape[1]

    @property
    def degree(self) -> int:
        """Degree of the polynomials in cos(theta2)."""
        return len(self.A) - 1

    def at(self, theta2: float) -> StateSpace:
        """The linear model at one working point."""
        A, B, C = (_values(part, np.array([theta2]))[0] for part in (self.A, self.B, self.C))
        return StateSpace(A, B, C)

    def respond(self, u: np.ndarray, theta2: np.ndarray) -> np.ndarray:
        """(N, ny) from rest, with u (N, nu) along theta2 (N,)."""
        A, B, C = (_values(part, theta2) for part in (self.A, self.B, self.C))
        return respond_along(A, np.einsum("tij,tj->ti", B, u), C)


def identify_interpolated(
    data: Sequence[Data], theta2: Sequence[float], order: int
) -> Interpolated:
    """The conventional route: a black box per working point (rad, rising), then one model.

    Order, degree and reference are those that predict each inner point best from the others.
    """
    places = np.asarray(theta2)
    degrees = [d for d in DEGREES if d < len(data)]
    best: tuple[tuple[float, int], list[StateSpace], int] | None = None
    orders = [order - fewer for fewer in FEWER_STATES]
    found = [identify_subspace(u, y, orders) for u, y in data]
    for models in zip(*found, strict=True):
        choices = list(product((_like_neighbours(models), _like_middle(models)), degrees))
        for error, (common, degree) in zip(
            _left_out_errors(choices, places, data), choices, strict=True
        ):
            if best is None or (error, -degree) < best[0]:
                best = (error, -degree), common, degree
    assert best is not None
    return _through(best[1], places, best[2])


def _through(common: Sequence[StateSpace], theta2: np.ndarray, degree: int) -> Interpolated:
    """Least squares through models in common coordinates."""
    basis = _powers(theta2, min(degree, len(common) - 1))

    def fitted(parts: list[np.ndarray]) -> np.ndarray:
        flat = np.array([part.ravel() for part in parts])
        found = np.linalg.lstsq(basis, flat, rcond=None)[0]
        return np.asarray(found.reshape(-1, *parts[0].shape))

    return Interpolated(
        fitted([m.A for m in common]), fitted([m.B for m in common]), fitted([m.C for m in common])
    )


def _left_out_errors(
    choices: Sequence[tuple[list[StateSpace], int]], theta2: np.ndarray, data: Sequence[Data]
) -> list[float]:
    """Per (models in common coordinates, degree) the squared error on the data of each inner
    point, by a model that has not seen it."""
    total = np.zeros(len(choices))
    for k in range(1, len(theta2) - 1):
        rest = [i for i in range(len(theta2)) if i != k]
        models = [
            _through([common[i] for i in rest], theta2[rest], degree).at(float(theta2[k]))
            for common, degree in choices
        ]
        u, y = data[k]
        with np.errstate(over="ignore", invalid="ignore"):
            total += np.sum((respond_all(models, u) - y) ** 2, axis=(1, 2))
    return [float(t) if np.isfinite(t) else np.inf for t in total]


def _like_neighbours(models: Sequence[StateSpace]) -> list[StateSpace]:
    """Each like its neighbour nearer the middle: follows modes that wander far."""
    middle = len(models) // 2
    found = {middle: _balanced(models[middle])}
    for step in (1, -1):
        k = middle + step
        while 0 <= k < len(models):
            found[k] = _like(models[k], found[k - step])
            k += step
    return [found[k] for k in range(len(models))]


def _like_middle(models: Sequence[StateSpace]) -> list[StateSpace]:
    """Each like the one in the middle: errors do not add up from point to point."""
    middle = len(models) // 2
    reference = _balanced(models[middle])
    return [reference if k == middle else _like(m, reference) for k, m in enumerate(models)]


def _like(model: StateSpace, reference: StateSpace) -> StateSpace:
    """The model in the state in which its observability matrix is nearest to the reference's."""
    own, other = model.observability(ROWS), reference.observability(ROWS)
    return model.transformed(np.linalg.lstsq(own, other, rcond=None)[0])


def _balanced(model: StateSpace) -> StateSpace:
    """In a state of which all directions are seen alike."""
    _, size, right = np.linalg.svd(model.observability(ROWS), full_matrices=False)
    return model.transformed(right.T / size)


def _powers(theta2: np.ndarray, degree: int) -> np.ndarray:
    return np.asarray(np.cos(theta2)[:, None] ** np.arange(degree + 1))


def _values(coefficients: np.ndarray, theta2: np.ndarray) -> np.ndarray:
    """(N, rows, columns)"""
    return np.einsum("tk,kij->tij", _powers(theta2, len(coefficients) - 1), coefficients)
