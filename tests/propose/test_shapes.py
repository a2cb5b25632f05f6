"""Every shape is one function in three ways: as a formula, as columns, and as what it says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from flexgui.core.effects.own import own_effect
from flexgui.core.effects.own_formula import MOST_PARAMETERS, own_parameter
from flexgui.core.forces.compiled import compile_law
from flexgui.core.propose.shapes import SHAPES, Shape
from tests.helpers import PAPER

RANGES = [(-0.5, 1.25), (2.0, 5.0), (-3.0, -1.25), (0.0, 0.001)]
"""Ends in few digits: a formula is written with six."""

ROUNDING = 1e-9
"""Of the largest value: two orders of the same operations."""

EVERY_SHAPE = pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.title)
EVERY_RANGE = pytest.mark.parametrize(("low", "high"), RANGES)


def spline(x: np.ndarray, low: float, high: float, *values: float) -> np.ndarray:
    """What cubic convolution is: cubics with the slopes of central differences."""
    knots = np.linspace(low, high, len(values))
    slopes = np.gradient(np.array(values), knots)
    return np.asarray(CubicHermiteSpline(knots, values, slopes)(np.clip(x, low, high)))


IN_NUMPY = {
    "max": np.maximum, "abs": np.abs, "tanh": np.tanh, "exp": np.exp, "sin": np.sin, "cos": np.cos,
    "spline": spline,
}  # fmt: skip


def as_python(shape: Shape, x: np.ndarray, low: float, high: float, values: Sequence[float]):
    """The values (n,) of its formula as Python reads it, without the language of formulas."""
    text = shape.formula("theta1", low, high, {name: name for name in shape.names})
    words = dict(zip(shape.names, values, strict=True))
    return np.broadcast_to(eval(text, {**IN_NUMPY, **words, "theta1": x}), x.shape)


def as_formula(shape: Shape, x: np.ndarray, low: float, high: float, values: Sequence[float]):
    """The values (n,) of its formula as a torque at joint 1."""
    text = shape.formula("theta1", low, high, {name: name for name in shape.names})
    pairs = zip(shape.names, values, strict=True)
    parameters = tuple(own_parameter(name, float(value)) for name, value in pairs)
    law, zero = compile_law(own_effect(PAPER, "joint1", text, parameters, "own_1").stated), [0.0]
    given = np.array(values, dtype=float)
    return np.array([law(np.array([place]), np.array(zero), np.zeros(0), given)[0] for place in x])


def drawn(shape: Shape, low: float, high: float, seed: int = 0):
    """Places a little beyond the range too, constants of the grid, and sizes."""
    rng = np.random.default_rng(seed)
    span = high - low
    grid = shape.grid(low, high)
    constants = grid[rng.integers(len(grid))]
    sizes = rng.normal(size=len(shape.sizes))
    return rng.uniform(low - 0.1 * span, high + 0.1 * span, 25), constants, sizes


@EVERY_RANGE
@EVERY_SHAPE
def test_the_columns_times_the_sizes_are_the_formula(shape, low, high) -> None:
    for seed in range(3):
        x, constants, sizes = drawn(shape, low, high, seed)
        found = shape.columns(x, low, high, constants) @ sizes
        read = as_python(shape, x, low, high, [*sizes, *constants])
        assert found == pytest.approx(read, abs=ROUNDING * np.abs(read).max())


@EVERY_RANGE
@EVERY_SHAPE
def test_the_columns_times_the_sizes_are_the_torque_of_an_own_effect(shape, low, high) -> None:
    x, constants, sizes = drawn(shape, low, high)
    found = shape.columns(x, low, high, constants) @ sizes
    torque = as_formula(shape, x, low, high, [*sizes, *constants])
    assert found == pytest.approx(torque, abs=ROUNDING * np.abs(torque).max())


@EVERY_RANGE
@EVERY_SHAPE
def test_its_sizes_have_the_powers_of_the_unit_that_they_state(shape, low, high) -> None:
    """In another unit of the variable each column is as much larger as its power says."""
    x, constants, _ = drawn(shape, low, high)
    k = 57.3
    moved = [c * k**own.power for c, own in zip(constants, shape.constants, strict=True)]
    plain = shape.columns(x, low, high, constants)
    scaled = shape.columns(k * x, k * low, k * high, moved)
    powers = k ** np.array([size.power for size in shape.sizes])
    assert scaled == pytest.approx(plain * powers, rel=1e-6, abs=ROUNDING * np.abs(scaled).max())


@EVERY_RANGE
@EVERY_SHAPE
def test_constants_of_the_grid_are_in_range_and_leave_no_column_empty(shape, low, high) -> None:
    grid = np.array(shape.grid(low, high), dtype=float)
    assert grid.shape == (len(grid), len(shape.constants)) and len(grid)
    assert len(np.unique(grid, axis=0)) == len(grid)
    for k, constant in enumerate(shape.constants):
        if constant.place:
            assert np.all((grid[:, k] > low) & (grid[:, k] < high))
        else:
            assert np.all(grid[:, k] > 0.0), "its bounds are parts of where it begins"
    x = np.linspace(low, high, 401)
    for constants in shape.grid(low, high):
        columns = shape.columns(x, low, high, constants)
        assert columns.shape == (len(x), len(shape.sizes))
        assert np.isfinite(columns).all() and np.all(np.abs(columns).max(axis=0) > 0.0)


@EVERY_RANGE
def test_a_wave_fits_half_a_time_to_ten_times_into_the_range(low, high) -> None:
    (wave,) = (shape for shape in SHAPES if shape.title == "wave")
    times = np.array(wave.grid(low, high)).ravel() * (high - low) / (2.0 * np.pi)
    assert (times.min(), times.max()) == pytest.approx((0.5, 10.0))


@EVERY_SHAPE
def test_what_a_shape_leaves_open_is_named_once_and_occurs_in_it(shape) -> None:
    assert len(set(shape.names)) == len(shape.names) == shape.parameters <= MOST_PARAMETERS
    assert all(f"{{{name}}}" in shape.text for name in shape.names)
    assert shape.varies == (shape.title != "constant")
    assert shape.angles == ("wave" in shape.title)
    assert [(s.title, s.text) for s in SHAPES if shape.title == s.title or shape.text == s.text] \
        == [(shape.title, shape.text)]  # fmt: skip


def test_a_table_reads_the_values_at_its_knots() -> None:
    (table,) = (shape for shape in SHAPES if shape.title == "table of 9 values")
    x = np.linspace(-0.5, 1.25, 9)
    assert table.columns(x, -0.5, 1.25, ()) == pytest.approx(np.eye(9), abs=ROUNDING)
