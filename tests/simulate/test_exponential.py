"""exp(A) of eight matrices at once against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from flexgui.core.lanes.wide import LANES
from flexgui.core.simulate.discrete import exponential

AGREEMENT = 1e-12
"""Relative to the largest entry, for well-conditioned matrices."""

STIFF_AGREEMENT = 1e-9
"""Twenty squarings multiply roundings by the condition of the exponential."""


def exponentials(matrices: np.ndarray) -> np.ndarray:
    """exp of matrices (LANES, n, n)."""
    n = matrices.shape[1]
    columns = np.array(np.moveaxis(matrices, 0, -1).reshape(n * n, LANES), order="C")
    found = exponential(columns, n, np.empty((5, n * n, LANES)))
    return np.moveaxis(np.array(found).reshape(n, n, LANES), -1, 0)


def worst(matrices: np.ndarray) -> float:
    found = exponentials(matrices)
    exact = np.array([expm(A) for A in matrices])
    size = np.abs(exact).max(axis=(1, 2))
    return float((np.abs(found - exact).max(axis=(1, 2)) / size).max())


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 13])
@pytest.mark.parametrize("norm", [1e-8, 0.1, 1.0, 10.0])
def test_random_matrices(n: int, norm: float) -> None:
    matrices = np.random.default_rng(n).standard_normal((LANES, n, n)) * norm / n
    assert worst(matrices) < AGREEMENT


def test_stiff_matrices_with_poles_from_one_to_a_million() -> None:
    """Symmetric, so that the exponential itself is well conditioned."""
    rng = np.random.default_rng(3)
    matrices = []
    for _ in range(LANES):
        V, _ = np.linalg.qr(rng.standard_normal((6, 6)))
        matrices.append(V @ np.diag(-np.logspace(0.0, 6.0, 6) * 1e-3) @ V.T)
    assert worst(np.array(matrices)) < STIFF_AGREEMENT


def test_nilpotent_matrices_give_their_finite_sum() -> None:
    A = np.triu(np.random.default_rng(4).uniform(-1.0, 1.0, (LANES, 4, 4)), 1)
    A2, A3 = A @ A, A @ A @ A
    assert np.abs(exponentials(A) - (np.eye(4) + A + A2 / 2.0 + A3 / 6.0)).max() < AGREEMENT


def test_lanes_do_not_touch_each_other() -> None:
    """A stiff neighbour decides the squarings, not the result."""
    rng = np.random.default_rng(5)
    matrices = rng.standard_normal((LANES, 4, 4))
    matrices[1] = -np.diag([1.0, 1e2, 1e4, 1e5])
    assert worst(matrices) < STIFF_AGREEMENT


def test_zero_gives_the_identity() -> None:
    assert np.array_equal(exponentials(np.zeros((LANES, 3, 3))), np.tile(np.eye(3), (LANES, 1, 1)))
