"""The compiled low-pass against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from flexgui.core.errors import InputError
from flexgui.core.identify.processing import filtered
from flexgui.core.recording.velocity import ZeroPhaseLowPass

DT = 2e-3
ROUNDING = 1e-12
"""Of a random walk of order ten, through up to ten sections."""


@pytest.mark.parametrize("order", [1, 2, 3, 4, 7, 10])
@pytest.mark.parametrize("shape", [(400, 1), (400, 5), (60, 2, 3)])
def test_it_is_scipys_forwards_and_backwards(order: int, shape: tuple[int, ...]) -> None:
    low_pass = ZeroPhaseLowPass(cutoff_hz=80.0, order=order)
    x = np.cumsum(np.random.default_rng(order).standard_normal(shape), axis=0)
    sections = signal.butter(order, 80.0, fs=1.0 / DT, output="sos")
    padding = low_pass.padding(len(x), DT)
    wanted = signal.sosfiltfilt(sections, x, axis=0, padlen=padding)
    np.testing.assert_allclose(filtered(low_pass, x, DT), wanted, rtol=0, atol=ROUNDING)


def test_signals_are_left_as_they_are_and_may_be_views() -> None:
    low_pass = ZeroPhaseLowPass(cutoff_hz=30.0)
    both = np.random.default_rng(1).standard_normal((300, 4))
    kept = both.copy()
    found = filtered(low_pass, both[:, ::2], DT)
    np.testing.assert_array_equal(both, kept)
    np.testing.assert_array_equal(found, filtered(low_pass, both[:, ::2].copy(), DT))


def test_a_signal_that_is_too_short_is_empty() -> None:
    low_pass = ZeroPhaseLowPass(cutoff_hz=30.0)
    few = low_pass.shortest - 1
    assert np.isnan(filtered(low_pass, np.ones((few, 2)), DT)).all()
    np.testing.assert_allclose(filtered(low_pass, np.ones((few + 1, 2)), DT), 1.0, atol=ROUNDING)


def test_a_cut_off_beyond_half_the_rate_is_refused() -> None:
    with pytest.raises(InputError, match="must be below 250 Hz"):
        filtered(ZeroPhaseLowPass(cutoff_hz=250.0), np.ones((100, 1)), DT)
