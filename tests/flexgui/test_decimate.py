import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from flexgui.views.layout import decimate, trace


@given(st.integers(0, 9000), st.integers(0, 5), st.sampled_from([100, 2000]))
def test_extremes_survive_and_points_are_few(n: int, seed: int, points: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=n)
    values[rng.random(n) < 0.2] = np.nan
    index = decimate(np.arange(n) * 1e-3, values, points)
    assert index.size <= points
    assert np.all(np.diff(index) > 0)
    assert np.all(np.isfinite(values[index]))
    if np.isfinite(values).any():
        assert values[index].max() == np.nanmax(values)
        assert values[index].min() == np.nanmin(values)


def test_a_line_breaks_where_samples_are_missing_for_long() -> None:
    time = np.arange(5000) * 1e-3
    values = np.sin(time)
    values[2000:2500] = np.nan
    x, y = trace(time, values)
    (gap,) = np.flatnonzero(np.isnan(y))
    assert x[gap - 1] < 2.0 + 1e-6
    assert x[gap + 1] > 2.5 - 1e-6


def test_a_slow_camera_draws_one_line() -> None:
    time = np.arange(3000) * 1e-3
    values = np.full(3000, np.nan)
    values[::10] = np.sin(time[::10])
    _, y = trace(time, values)
    assert y.size == 300
    assert np.isfinite(y).all()
