"""Recordings with fewer instants: nothing folded, references exact, gaps and masks kept."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.recording.decimation import first_part, low_pass, thinned
from flexgui.core.recording.recording import Recording

DT = 1e-4
N = 20_001
REFERENCE = "dtheta1_ref"
HOLD = 200
"""Samples."""

FLAT = 1e-4
"""Of an amplitude: what the low-pass changes where it should change nothing, at 80 dB."""


def _recording(**more: np.ndarray) -> Recording:
    t = np.arange(N) * DT
    signs = np.random.default_rng(0).choice([-0.3, 0.3], N // HOLD + 1)
    channels = {
        REFERENCE: np.repeat(signs, HOLD)[:N],
        "theta1": 0.4 + np.sin(2.0 * np.pi * 20.0 * t),
        **more,
    }
    return Recording("a", t, channels)


def test_slow_motion_passes_and_fast_vibration_is_not_folded() -> None:
    t = np.arange(N) * DT
    slow, fast = np.sin(2.0 * np.pi * 20.0 * t), np.sin(2.0 * np.pi * 980.0 * t)
    r = _recording(theta2=slow + fast)
    found = thinned(r, 10, [REFERENCE])
    assert found.sample_time == pytest.approx(10 * DT)
    inside = slice(10, -10)  # the ends are continued, which a vibration is not
    assert np.max(np.abs(found["theta1"] - r["theta1"][::10])) < FLAT
    assert np.max(np.abs((found["theta2"] - slow[::10])[inside])) < FLAT
    assert np.max(np.abs(r["theta2"][::10] - slow[::10])) > 0.9  # picked plainly it is folded


def test_noise_falls_as_by_averaging() -> None:
    noise = np.random.default_rng(1).standard_normal(N)
    found = thinned(_recording(theta2=noise), 10, [REFERENCE])
    expected = np.sqrt(np.sum(low_pass(10) ** 2))
    assert np.std(found["theta2"]) == pytest.approx(expected, rel=0.05)
    assert expected < 0.4


def test_held_references_stay_exactly_what_they_were() -> None:
    r = _recording()
    found = thinned(r, 25, [REFERENCE])
    assert np.array_equal(found[REFERENCE], r[REFERENCE][::25])
    assert np.array_equal(np.repeat(found[REFERENCE], 25)[:N], r[REFERENCE])


def test_samples_of_a_slow_camera_are_kept_as_they_are() -> None:
    t = np.arange(N) * DT
    camera = np.full(N, np.nan)
    camera[::20] = np.cos(t[::20])
    r = _recording(z1=camera)
    found = thinned(r, 10, [REFERENCE])
    assert np.array_equal(found["z1"], camera[::10], equal_nan=True)


def test_gaps_and_masks_reach_no_further_than_the_low_pass() -> None:
    t = np.arange(N) * DT
    camera = np.full(N, np.nan)
    camera[::2] = np.cos(20.0 * t[::2])
    camera[5_000:5_100] = np.nan
    mask = np.ones(N, dtype=bool)
    mask[9_000:9_010] = False
    r = _recording(z1=camera)
    r = Recording("d", t, r.channels, counted={"theta1": mask})
    found = thinned(r, 10, [REFERENCE])
    half = len(low_pass(10)) // 2 + 2
    empty = np.flatnonzero(np.isnan(found["z1"])) * 10
    inner = empty[(empty > half) & (empty < N - 1 - half)]
    assert np.all((inner >= 5_000 - half) & (inner <= 5_100 + half))
    assert np.all(np.isin(np.arange(5_000, 5_100, 10), inner))
    kept = np.isfinite(found["z1"])
    assert np.max(np.abs(found["z1"] - np.cos(20.0 * found.time))[kept]) < FLAT
    left_out = np.flatnonzero(~found.counted["theta1"]) * 10
    assert np.all(np.isin(np.arange(9_000, 9_010, 10), left_out))
    assert np.all(np.abs(left_out - 9_005) <= half + 5)


def test_a_recording_that_is_not_thinned_is_itself() -> None:
    r = _recording()
    assert thinned(r, 1, [REFERENCE]) is r
    assert first_part(r, N) is r
    assert len(first_part(r, 100).time) == 100
