"""The linear algebra written out for a number of coordinates, against LAPACK."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from numba import njit

from core.arm.compiled import compile_wide_arm
from core.arm.solvers import MOST_WRITTEN_OUT
from core.arm.symbols import Structure
from core.lanes.wide import LANES
from tests.helpers import chain

ROUNDING = 1e-12
"""Relative, for well-conditioned matrices of up to 13 rows."""

SIZES = {1: (0,), 3: (2,), 8: (3, 3), 13: (3, 3, 3)}
"""Coordinates -> modes of each segment; with three segments a joint is elastic too."""


@njit
def of_two(function, a, b):  # type: ignore[no-untyped-def]
    function(a, b)


@njit
def of_three(function, a, b, c):  # type: ignore[no-untyped-def]
    function(a, b, c)


def solvers(n: int) -> dict[str, Callable[..., Any]]:
    arm = chain(*SIZES[n])
    if arm.joints == 3:
        elastic = arm.segments[0].model_copy(update={"joint_compliance": 1e-3})
        arm = arm.model_copy(update={"segments": (elastic, *arm.segments[1:])})
    assert arm.coordinates == n
    calls = {
        "factor": of_two, "substitute": of_two, "solve_positive": of_two,
        "multiply": of_three, "subtract": of_three,
    }  # fmt: skip
    compiled = compile_wide_arm(Structure.of(arm)).solvers
    return {name: partial(calls[name], f) for name, f in zip(calls, compiled, strict=True)}


def matrices(n: int) -> np.ndarray:
    """(LANES, n, n), not symmetric, dominated by their diagonals."""
    A = np.random.default_rng(n).normal(size=(LANES, n, n))
    return A + 3.0 * n * np.eye(n)


def wide(A: np.ndarray) -> np.ndarray:
    """(entries, LANES) from (LANES, ...)."""
    return np.array(A.reshape(LANES, -1).T, order="C")


@pytest.mark.parametrize("n", SIZES)
def test_factors_solve_as_lapack_does_in_every_lane(n: int) -> None:
    work, A = solvers(n), matrices(n)
    b = np.random.default_rng(1).normal(size=(LANES, n, 1))
    found, factors, growth = wide(b), wide(A), np.ones((1, LANES))
    work["factor"](factors, growth)
    work["substitute"](factors, found)
    np.testing.assert_allclose(found, wide(np.linalg.solve(A, b)), rtol=ROUNDING, atol=ROUNDING)
    assert np.all(growth >= 1.0) and np.all(growth < 2.0)


def test_a_pivot_that_vanishes_shows_as_growth_in_its_lane_only() -> None:
    A = np.stack([np.array([[1.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]])] * LANES)
    A[3, 0, 1] = A[3, 1, 0] = 1.0 - 1e-9
    growth = np.ones((1, LANES))
    solvers(3)["factor"](wide(A), growth)
    assert growth[0, 3] == pytest.approx(0.5e9, rel=1e-6)
    assert np.delete(growth[0], 3).max() == pytest.approx(4.0 / 3.0)


@pytest.mark.parametrize("n", SIZES)
def test_a_positive_matrix_is_solved_and_left_in_its_factors(n: int) -> None:
    work, A = solvers(n), matrices(n)
    A = A @ A.transpose(0, 2, 1)
    b = np.random.default_rng(2).normal(size=(LANES, n, 1))
    found, factors = wide(b), wide(A)
    work["solve_positive"](factors, found)
    np.testing.assert_allclose(found, wide(np.linalg.solve(A, b)), rtol=ROUNDING, atol=ROUNDING)
    whole = factors.T.reshape(LANES, n, n)
    L = np.tril(whole, -1) + np.eye(n)
    D = np.einsum("lii,ij->lij", 1.0 / whole, np.eye(n))
    scale = np.abs(A).max()
    np.testing.assert_allclose(L @ D @ L.transpose(0, 2, 1), A, atol=ROUNDING * scale)


@pytest.mark.parametrize("n", SIZES)
def test_products_are_numpys(n: int) -> None:
    work, A = solvers(n), matrices(n)
    x, start = np.random.default_rng(3).normal(size=(2, LANES, n, 1))
    out, less = np.empty((n, LANES)), wide(start)
    work["multiply"](wide(A), wide(x), out)
    work["subtract"](wide(A), wide(x), less)
    np.testing.assert_allclose(out, wide(A @ x), rtol=ROUNDING, atol=ROUNDING)
    np.testing.assert_allclose(less, wide(start - A @ x), rtol=ROUNDING, atol=ROUNDING)


def test_both_ways_to_write_them_are_tried_here() -> None:
    assert min(SIZES) < MOST_WRITTEN_OUT < max(SIZES)
