"""Statements written as instructions say what Python makes of the same text."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest
from numba import njit

from flexgui.core.arm.instructions import straight_line
from flexgui.core.lanes import functions
from flexgui.core.lanes.functions import absolute, maximum
from flexgui.core.lanes.wide import LANES

COLUMNS = 3

ROUNDING = 1e-13
"""Relative: a sum may be fused with a product, and a power taken by squaring."""


def arithmetic(x, M, out):  # type: ignore[no-untyped-def]
    a = x[0]
    b = -(2 / 3) * a + 5
    c = b**7 - a / (1 + b * b) - -a
    M[0, 0] = 0
    M[1, 2] = c
    M[1, 2] += cos(a) * sin(b)
    M[0, 1] = M[1, 2] - 3
    out[0] = (1 / 7) * c
    out[1] = x[1] ** 2


def lanes(x, M, out):  # type: ignore[no-untyped-def]
    a = x[0]
    b = -(2 / 3) * a + 5
    M[0, 2] = functions_cos(a) * b - x[1]
    M[0, 1] = 0.0
    out[0] = maximum(absolute(a), b / 4)


functions_cos = functions.cos
narrow = straight_line(COLUMNS)(arithmetic)
wide = straight_line(COLUMNS, lanes=True, fast=("contract",))(lanes)


@njit
def in_narrow(x, M, out):  # type: ignore[no-untyped-def]
    narrow(x, M, out)


@njit
def in_wide(x, M, out):  # type: ignore[no-untyped-def]
    wide(x, M, out)


@pytest.fixture(params=range(3))
def numbers(request: pytest.FixtureRequest) -> np.ndarray:
    return np.random.default_rng(request.param).normal(size=(2, LANES))


def test_doubles_are_what_python_makes_of_them(numbers: np.ndarray) -> None:
    x = numbers[:, 0].copy()
    M, out, known, also = np.ones((2, COLUMNS)), np.ones(2), np.ones((2, COLUMNS)), np.ones(2)
    in_narrow(x, M, out)
    arithmetic(x, known, also)
    np.testing.assert_allclose(M, known, rtol=ROUNDING)
    np.testing.assert_allclose(out, also, rtol=ROUNDING)


def test_each_lane_is_computed_as_if_it_were_alone(numbers: np.ndarray) -> None:
    M, out = np.ones((2 * COLUMNS, LANES)), np.ones((1, LANES))
    in_wide(numbers, M, out)
    a, b = numbers[0], -2 / 3 * numbers[0] + 5
    np.testing.assert_allclose(M[2], np.cos(a) * b - numbers[1], rtol=ROUNDING, atol=ROUNDING)
    np.testing.assert_array_equal(M[[0, 1, 3]], [np.ones(LANES), np.zeros(LANES), np.ones(LANES)])
    np.testing.assert_allclose(out[0], np.maximum(np.abs(a), b / 4), rtol=ROUNDING)
