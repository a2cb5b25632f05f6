"""Subspace identification of one linear model from one experiment: PO-MOESP.

x(t+1) = A x + B u, y = C x + e. Past inputs and outputs are the instruments, so that white or
coloured noise on the outputs leaves A and C unbiased (Verhaegen and Verdult, Filtering and System
Identification, 2007, section 9.6). B and the initial state follow by least squares on the outputs
themselves, in which they are linear once A and C are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.errors import InputError

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

    @property
    def numbers(self) -> int:
        """Entries of A, B and C."""
        return self.A.size + self.B.size + self.C.size

    def transformed(self, T: np.ndarray) -> StateSpace:
        """In the state T^-1 x."""
        return StateSpace(np.linalg.solve(T, self.A @ T), np.linalg.solve(T, self.B), self.C @ T)

    def observability(self, rows: int) -> np.ndarray:
        """(rows ny, n): C, C A, C A^2, ..."""
        blocks = [self.C]
        for _ in range(rows - 1):
            blocks.append(blocks[-1] @ self.A)
        return np.vstack(blocks)

    def respond(self, u: np.ndarray) -> np.ndarray:
        """(N, ny) from rest."""
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
    """From u (N, nu) and y (N, ny), one model per order with the window that fits it best."""
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
            f"{8 * WINDOWS[0] * (u.shape[1] + y.shape[1])} at least."
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
    found, *_ = np.linalg.lstsq(flat, y.ravel(), rcond=None)
    error = float(np.sum((flat @ found - y.ravel()) ** 2))
    return found[: n * nu].reshape(n, nu), error
