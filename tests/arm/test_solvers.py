"""The linear algebra written out for a number of coordinates, against LAPACK."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from numba import njit

from flexgui.core.arm.arm import Structure
from flexgui.core.arm.cache import cached_module, module_file, sources_key
from flexgui.core.arm.compiled import _name as name_of
from flexgui.core.arm.compiled import compile_wide_arm
from flexgui.core.arm.generate import module_head
from flexgui.core.arm.solvers import solver_functions
from flexgui.core.lanes.wide import LANES
from tests.helpers import chain

ROUNDING = 1e-12
"""Relative, for well-conditioned matrices of up to 13 rows."""

SIZES = (1, 3, 8, 13)
"""Coordinates: a rigid link, one of two modes, two of three, three of three with a soft joint."""
ARMS = {1: (0,), 3: (2,)}
"""Coordinates -> modes of an arm whose own module is tried. The larger ones are tried without the
equations of an arm, which take most of the time to compile and are not used here."""


@njit
def of_two(function, a, b):  # type: ignore[no-untyped-def]
    function(a, b)


@njit
def of_three(function, a, b, c):  # type: ignore[no-untyped-def]
    function(a, b, c)


CALLS = {
    "factor": of_two, "substitute": of_two, "solve_positive": of_two,
    "multiply": of_three, "subtract": of_three,
}  # fmt: skip


def structure(n: int) -> Structure:
    found = Structure.of(chain(*ARMS[n]))
    assert found.coordinates == n
    return found


@cache
def solvers(n: int) -> dict[str, Callable[..., Any]]:
    compiled = compile_wide_arm(structure(n)).solvers if n in ARMS else apart(n)
    return {name: partial(CALLS[name], f) for name, f in zip(CALLS, compiled, strict=True)}


def apart(n: int) -> tuple[Any, ...]:
    """As the module of an arm has them, but alone."""
    text = module_head(n, wide=True) + "".join(solver_functions(n))
    key = hashlib.sha256(f"{text}{sources_key()}".encode()).hexdigest()[:20]
    module = cached_module(f"solvers_{key}", lambda: text)
    return tuple(getattr(module, name) for name in CALLS)


@pytest.mark.parametrize("n", ARMS)
def test_the_module_of_an_arm_is_made_of_this_head_and_these_solvers(n: int) -> None:
    compile_wide_arm(structure(n))
    text = module_file(f"wide_{name_of(structure(n))}").read_text("utf-8")
    assert text.startswith(module_head(n, wide=True)) and "".join(solver_functions(n)) in text


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
