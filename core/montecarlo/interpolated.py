"""Local linear models made one: common state coordinates, then matrices as polynomials.

A model from a black box has a state of its own choosing, so that two of them cannot be mixed.
Each is first brought to coordinates in which its observability matrix is as near as possible to
that of a reference; then every entry of A, B and C is a polynomial in cos(theta2), fitted by
least squares (J. De Caigny, J. F. Camino and J. Swevers, Interpolation-based modeling of MIMO
LPV systems, IEEE Trans. Control Systems Technology 19, 2011).

The local models come by subspace identification, PO-MOESP: x(t+1) = A x + B u, y = C x + e. Past
inputs and outputs are the instruments, so that white or coloured noise on the outputs leaves A and
C unbiased (Verhaegen and Verdult, Filtering and System Identification, 2007, section 9.6). B and
the initial state follow by least squares on the outputs themselves, in which they are linear once A
and C are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..errors import InputError

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
        """The linear model at one working point `theta2` in rad."""
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
    identified = [identify_subspace(u, y, orders) for u, y in data]
    for models in zip(*identified, strict=True):
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
        coefficients = np.linalg.lstsq(basis, flat, rcond=None)[0]
        return np.asarray(coefficients.reshape(-1, *parts[0].shape))

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
        others = [i for i in range(len(theta2)) if i != k]
        models = [
            _through([common[i] for i in others], theta2[others], degree).at(float(theta2[k]))
            for common, degree in choices
        ]
        u, y = data[k]
        with np.errstate(over="ignore", invalid="ignore"):
            total += np.sum((respond_all(models, u) - y) ** 2, axis=(1, 2))
    return [float(t) if np.isfinite(t) else np.inf for t in total]


def _like_neighbours(models: Sequence[StateSpace]) -> list[StateSpace]:
    """Each like its neighbour nearer the middle: follows modes that wander far."""
    middle = len(models) // 2
    transformed = {middle: _balanced(models[middle])}
    for step in (1, -1):
        k = middle + step
        while 0 <= k < len(models):
            transformed[k] = _like(models[k], transformed[k - step])
            k += step
    return [transformed[k] for k in range(len(models))]


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


WINDOWS = (15, 30, 60)
"""Block rows that are tried; the one with the least error on its own data is kept."""

STABLE = 0.99999
"""Largest modulus of a pole that is left as it is; others are mirrored into the unit circle."""


@dataclass(frozen=True)
class StateSpace:
    """A (n, n), B (n, nu), C (ny, n) per sample."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray

    def transformed(self, T: np.ndarray) -> StateSpace:
        """In the state T^-1 x, with T (n, n)."""
        return StateSpace(np.linalg.solve(T, self.A @ T), np.linalg.solve(T, self.B), self.C @ T)

    def observability(self, rows: int) -> np.ndarray:
        """(rows ny, n): C, C A, C A^2, ..."""
        blocks = [self.C]
        for _ in range(rows - 1):
            blocks.append(blocks[-1] @ self.A)
        return np.vstack(blocks)

    def respond(self, u: np.ndarray) -> np.ndarray:
        """(N, ny) from rest, with u (N, nu)."""
        path = np.broadcast_to(self.A, (len(u), *self.A.shape))
        return respond_along(path, u @ self.B.T, np.broadcast_to(self.C, (len(u), *self.C.shape)))


def respond_along(A: np.ndarray, driven: np.ndarray, C: np.ndarray) -> np.ndarray:
    """(N, ny) from rest: A (N, n, n) and C (N, ny, n) may change, driven (N, n) = B u."""
    x = np.zeros(A.shape[1])
    y = np.empty((len(driven), C.shape[1]))
    with np.errstate(over="ignore", invalid="ignore"):  # an unstable mix grows without limit
        for t in range(len(driven)):
            y[t] = C[t] @ x
            x = A[t] @ x + driven[t]
    return y


def respond_all(models: Sequence[StateSpace], u: np.ndarray) -> np.ndarray:
    """(models, N, ny) from rest, of models of the same size to the same u (N, nu)."""
    A, C = np.array([m.A for m in models]), np.array([m.C for m in models])
    driven = np.einsum("mij,tj->tmi", np.array([m.B for m in models]), u)[..., None]
    x = np.zeros((len(models), A.shape[1], 1))
    states = np.empty((len(u), len(models), A.shape[1]))
    for t in range(len(u)):
        states[t] = x[..., 0]
        x = A @ x + driven[t]
    return np.einsum("mij,tmj->mti", C, states)


def identify_subspace(u: np.ndarray, y: np.ndarray, orders: Sequence[int]) -> list[StateSpace]:
    """From u (N, nu) and y (N, ny), one model per order with the window that fits it best;
    InputError where N is too small for any window."""
    best: dict[int, tuple[float, StateSpace]] = {}
    for window in WINDOWS:
        if 2 * window * (u.shape[1] + y.shape[1]) > len(u) // 4:
            continue
        left, size = _range(u, y, window)
        for order in orders:
            A, C = _dynamics(left[:, :order] * np.sqrt(size[:order]), y.shape[1])
            B, error = _inputs(A, C, u, y)
            if order not in best or error < best[order][0]:
                best[order] = error, StateSpace(A, B, C)
    if not best:
        raise InputError(
            f"A recording of {len(u)} samples is too short for a black-box model; a study needs "
            f"at least {8 * WINDOWS[0] * (u.shape[1] + y.shape[1])}."
        )
    return [best[order][1] for order in orders]


def _hankel(x: np.ndarray, rows: int) -> np.ndarray:
    """(rows k, N - rows + 1) from x (N, k)."""
    columns = len(x) - rows + 1
    return np.concatenate([x[k : k + columns].T for k in range(rows)])


def _range(u: np.ndarray, y: np.ndarray, window: int) -> tuple[np.ndarray, np.ndarray]:
    """Left singular vectors and values of the future outputs that only the past explains."""
    U, Y = _hankel(u, 2 * window), _hankel(y, 2 * window)
    mu, my = u.shape[1] * window, y.shape[1] * window
    stacked = np.concatenate([U[mu:], U[:mu], Y[:my], Y[my:]])
    L = np.asarray(np.linalg.qr(stacked.T, mode="r")).T
    left, size, _ = np.linalg.svd(L[2 * mu + my :, mu : 2 * mu + my])
    return left, size


def _dynamics(O: np.ndarray, ny: int) -> tuple[np.ndarray, np.ndarray]:  # noqa: E741
    """A and C from an observability matrix O (rows ny, order): it repeats itself one row later."""
    A = np.linalg.lstsq(O[:-ny], O[ny:], rcond=None)[0]
    return _stabilised(A), O[:ny]


def _stabilised(A: np.ndarray) -> np.ndarray:
    """The same modes with poles outside the unit circle mirrored into it: rest is rest."""
    poles, vectors = np.linalg.eig(A)
    size = np.abs(poles)
    if size.max() < STABLE:
        return A
    inside = np.where(size < STABLE, poles, poles / np.maximum(size, 1.0) ** 2 * STABLE)
    return np.asarray(np.real(vectors @ np.diag(inside) @ np.linalg.inv(vectors)))


def _inputs(A: np.ndarray, C: np.ndarray, u: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, float]:
    """B and the squared error that is left; the initial state is estimated and forgotten."""
    n, nu, ny = len(A), u.shape[1], C.shape[0]
    x = np.zeros((n, n * nu + n))
    x[:, n * nu :] = np.eye(n)
    slopes = np.empty((len(u), ny, n * nu + n))
    push = np.zeros((n, n, nu))
    for t in range(len(u)):
        slopes[t] = C @ x
        push[range(n), range(n)] = u[t]
        x = A @ x
        x[:, : n * nu] += push.reshape(n, n * nu)
    flat = slopes.reshape(-1, slopes.shape[2])
    solution, *_ = np.linalg.lstsq(flat, y.ravel(), rcond=None)
    error = float(np.sum((flat @ solution - y.ravel()) ** 2))
    return solution[: n * nu].reshape(n, nu), error
