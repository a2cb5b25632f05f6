"""What is soft swings: its size is where the model swings as the error does."""

from __future__ import annotations

import numpy as np
import pytest

from core.diagnose.resonance import _crossings

SIZES = np.geomspace(1e-6, 1e-3, 48)
TRUE = 2.34e-5
STIFF = 7.0
"""1/s^2 times a compliance: f = sqrt(STIFF / size) / 2 pi."""

WITHIN = 1e-3
"""Of the size: frequencies are straight in logarithms between sizes that a power law relates."""


def swings(size: float) -> float:
    return float(np.sqrt(STIFF / size) / (2.0 * np.pi))


def test_the_size_that_swings_at_a_frequency_is_found() -> None:
    modes = [np.array([swings(x)]) for x in SIZES]
    assert _crossings(SIZES, modes, swings(TRUE)) == [pytest.approx(TRUE, rel=WITHIN)]


def test_a_frequency_that_no_size_has_gives_none() -> None:
    modes = [np.array([swings(x)]) for x in SIZES]
    assert _crossings(SIZES, modes, 1e3 * swings(SIZES[0])) == []


def test_each_mode_that_passes_the_frequency_gives_a_size() -> None:
    modes = [np.array([swings(x), 3.0 * swings(x)]) for x in SIZES]
    found = _crossings(SIZES, modes, swings(TRUE))
    assert sorted(found) == [pytest.approx(TRUE, rel=WITHIN), pytest.approx(9 * TRUE, rel=WITHIN)]


def test_where_a_vibration_begins_or_ends_nothing_is_interpolated() -> None:
    modes = [np.array([swings(x)]) if i % 2 else np.empty(0) for i, x in enumerate(SIZES)]
    assert _crossings(SIZES, modes, swings(TRUE)) == []
