"""Where the motion in a column of places ends and its noise begins."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.recording.visible_band import VisibleBand, visible_band

DT, SECONDS = 1e-3, 6.0
TIME = np.arange(0.0, SECONDS, DT)
OCTAVE = 2.0
STEEP = 3.0
"""Times the cut-off: a filter of sixteenth order leaves six millionths at 2.1 times it; at 5 Hz a
band of six ordinates and the width of the window lie beyond."""
NOISE_KNOWN = 0.15
"""Relative, of a level read from a few hundred ordinates at the top."""


def motion(seed: int, hz: float, size: float = 0.1) -> np.ndarray:
    """(N,) places that wander with nothing but a ten-thousandth beyond twice `hz`."""
    rng = np.random.default_rng(seed)
    steep = ZeroPhaseLowPass(cutoff_hz=hz, order=8)
    wander = steep.apply(rng.standard_normal(len(TIME)), DT)
    return np.asarray(size * wander / wander.std())


def seen(x: np.ndarray) -> VisibleBand:
    found = visible_band([(x, DT)])
    assert found is not None
    return found


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(5.0, 60.0), st.floats(-5.5, -3.5))
def test_a_band_ends_where_the_motion_drowns_in_the_noise(seed, hz, decade):
    noise = 10.0**decade * np.random.default_rng(seed + 1).standard_normal(len(TIME))
    found = seen(motion(seed, hz) + noise)
    assert hz / OCTAVE < found.hz < STEEP * hz
    assert found.noise == pytest.approx(10.0**decade, rel=NOISE_KNOWN)
    assert not found.whole


@pytest.mark.parametrize("bits", [12, 14, 17, 20])
def test_an_encoder_that_counts_has_the_noise_of_its_steps(bits):
    step = 2.0 * np.pi / 2**bits
    found = seen(step * np.round(motion(3, 10.0, 0.5) / step))
    assert found.noise == pytest.approx(step / np.sqrt(12.0), rel=NOISE_KNOWN)


def test_more_noise_makes_no_band_wider():
    plain = motion(5, 10.0) + 1e-6 * np.sin(2.0 * np.pi * 40.0 * TIME)
    rng = np.random.default_rng(6)
    draw = rng.standard_normal(len(TIME))
    widths = [seen(plain + level * draw).hz for level in (1e-7, 1e-6, 1e-5, 1e-4, 1e-3)]
    assert widths == sorted(widths, reverse=True)


def test_a_machine_that_hums_beyond_the_motion_does_not_widen_it():
    noise = 1e-5 * np.random.default_rng(7).standard_normal(len(TIME))
    hum = 3e-5 * np.sin(2.0 * np.pi * 310.0 * TIME)
    assert seen(motion(7, 10.0) + noise + hum).hz < OCTAVE * 10.0


def test_all_recordings_tell_together():
    rng = np.random.default_rng(9)
    # At an octave beyond the cut-off this noise is twice what is left of the motion.
    columns = [(motion(s, 10.0) + 2e-5 * rng.standard_normal(len(TIME)), DT) for s in range(4)]
    found, alone = visible_band(columns), [seen(x).hz for x, _ in columns]
    assert found is not None and 10.0 / OCTAVE < found.hz < OCTAVE * 10.0
    assert min(alone) <= found.hz <= max(alone)


@pytest.mark.parametrize(
    "x", [np.zeros(1000), np.arange(100.0), np.full(1000, np.nan)], ids=["still", "short", "empty"]
)
def test_nothing_is_said_of_a_joint_that_shows_no_motion(x):
    assert visible_band([(x, DT)]) is None


def test_noise_alone_has_no_band_and_a_motion_at_all_frequencies_no_end():
    rng = np.random.default_rng(8)
    assert seen(np.cumsum(np.cumsum(rng.standard_normal(len(TIME))))).whole
    found = visible_band([(np.random.default_rng(10).standard_normal(len(TIME)), DT)])
    assert found is None or found.hz < 20.0 / SECONDS
