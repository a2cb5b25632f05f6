import numpy as np
import pytest
from scipy import signal

from flexgui.core.errors import InputError
from flexgui.core.recording.recording import LoggerFilter, apply_logger_filter
from flexgui.core.recording.velocity import ZeroPhaseLowPass, central_difference

DT = 1e-3
ROUNDING = 1e-9
"""Absolute; differences of values of order one over a millisecond."""
TIME = DT * np.arange(2000)


def test_central_difference_converges_with_the_second_power_of_the_step():
    errors = []
    for n in (100, 200, 400):
        t = np.linspace(0, 1, n + 1)
        errors.append(np.abs(central_difference(np.sin(5 * t), 1 / n) - 5 * np.cos(5 * t))[1:-1])
    ratios = [a.max() / b.max() for a, b in zip(errors, errors[1:], strict=False)]
    assert ratios == pytest.approx([4, 4], rel=0.05)


def test_a_slow_sensor_is_differentiated_at_its_own_rate():
    x = np.where(np.arange(2000) % 10 == 0, TIME**2, np.nan)
    velocity = central_difference(x, DT)
    np.testing.assert_array_equal(np.isfinite(velocity), np.isfinite(x))
    np.testing.assert_allclose(velocity[10:-10:10], 2 * TIME[10:-10:10], atol=ROUNDING)


def test_zero_phase_filter_halves_the_amplitude_at_its_cutoff_without_delay():
    tone = np.sin(2 * np.pi * 25 * TIME)
    out = ZeroPhaseLowPass(cutoff_hz=25.0).apply(tone, DT)
    np.testing.assert_allclose(out[500:1500], 0.5 * tone[500:1500], atol=1e-3)


def test_zero_phase_filter_never_bridges_a_gap():
    x = np.ones(2000)
    x[1000:] = 5.0
    x[990:1010] = np.nan
    out = ZeroPhaseLowPass(cutoff_hz=25.0).apply(x, DT)
    np.testing.assert_array_equal(np.isnan(out), np.isnan(x))
    np.testing.assert_allclose(out[:990], 1.0, atol=ROUNDING)
    np.testing.assert_allclose(out[1010:], 5.0, atol=ROUNDING)


def test_cutoff_beyond_half_the_rate_is_refused():
    with pytest.raises(InputError, match="below 500 Hz"):
        ZeroPhaseLowPass(cutoff_hz=600.0).apply(TIME, DT)


@pytest.mark.parametrize("damping", [0.4, 0.9, 1.0, 2.0])
def test_logger_filter_is_exact_for_piecewise_linear_input(damping):
    """Against the same filter on a grid a hundred times finer, by an independent simulation."""
    rng = np.random.default_rng(11)
    dt, w = 0.02, 12.57
    x = 1.0 + rng.normal(size=100)
    t = dt * np.arange(100)
    fine = np.linspace(0, t[-1], 99 * 100 + 1)
    system = signal.StateSpace(
        [[0, 1], [-w * w, -2 * damping * w]], [[0], [w * w]], [[1, 0]], [[0]]
    )
    _, reference, _ = signal.lsim(system, np.interp(fine, t, x), fine, X0=[x[0], 0.0])
    out = apply_logger_filter(x, dt, LoggerFilter(w, damping))
    np.testing.assert_allclose(out, reference[::100], atol=ROUNDING)
