"""Maps of errors that were put in by hand show them where they were put."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.error_maps import bands, error_maps, noise_floors, worst_cells
from flexgui.core.results import ChannelComparison, ErrorMaps, JointMotion, RecordingComparison

DT, SECONDS = 1e-3, 3.0
NOISE = 3e-5
"""m, rms of the white noise that every error has."""
RECORDINGS = ("th1", "th2", "th3")

SPREAD = 0.35
"""Relative: the rms of a cell with the fewest samples (twelve in the lowest band) scatters."""

LEAKAGE = 0.03
"""Relative: what a Hann window lets through into neighbouring bands."""


def compared(
    error: np.ndarray,
    name: str = "th1",
    channel: str = "z1",
    counted: np.ndarray | None = None,
    motion: JointMotion | None = None,
) -> RecordingComparison:
    time = 5.0 + DT * np.arange(len(error))
    counts = np.ones(len(error), dtype=bool) if counted is None else counted
    model = 0.05 * np.sin(7.0 * time)
    measured = np.where(counts, model + error, np.nan)
    one = ChannelComparison(channel, "m", time, measured, model, counts)
    return RecordingComparison(name, "estimate", "all", (one,), motion=motion)


def white(seed: int, seconds: float = SECONDS) -> np.ndarray:
    return NOISE * np.random.default_rng(seed).standard_normal(int(round(seconds / DT)))


def mapped(*recordings: RecordingComparison) -> ErrorMaps:
    return error_maps(recordings, {"z1": NOISE})


def test_an_error_at_the_floor_is_one_in_every_cell() -> None:
    maps = mapped(*(compared(white(k), name) for k, name in enumerate(RECORDINGS)))
    for one in (*maps.by_time, *maps.by_frequency):
        assert one.ratio.shape[0] == len(RECORDINGS)
        np.testing.assert_allclose(one.ratio, 1.0, rtol=SPREAD)


@settings(max_examples=30, deadline=None)
@given(st.integers(40, 2000), st.floats(0.0, 300.0), st.integers(0, 1000))
def test_the_squares_of_the_bands_add_up_to_the_squared_rms(n: int, hz: float, seed: int) -> None:
    error = (
        white(seed)[:1] + white(seed, n * DT) + 1e-4 * np.sin(2 * np.pi * hz * DT * np.arange(n))
    )
    counted = np.random.default_rng(seed).random(n) > 0.1
    recording = compared(error, counted=counted)
    (one,) = mapped(recording).by_frequency
    rms = recording.channels[0].rms
    assert np.nansum(one.rms**2) == pytest.approx(rms**2, rel=1e-9)


def test_a_vibration_stands_in_its_band_and_recording_alone() -> None:
    t = DT * np.arange(3000)
    errors = [white(k) for k in range(3)]
    errors[1] = errors[1] + 20 * NOISE * np.sin(2 * np.pi * 12.0 * t)
    maps = mapped(*(compared(e, n) for e, n in zip(errors, RECORDINGS, strict=True)))
    (one,) = maps.by_frequency
    band = int(np.searchsorted(one.edges, 12.0)) - 1
    assert np.unravel_index(np.nanargmax(one.ratio), one.ratio.shape) == (1, band)
    assert one.rms[1, band] == pytest.approx(20 * NOISE / np.sqrt(2), rel=LEAKAGE)
    worst = maps.worst[0]
    assert (worst.recording, worst.channel, worst.axis) == ("th2", "z1", "frequency")
    assert worst.low < 12.0 <= worst.high
    assert worst.ratio == pytest.approx(one.ratio[1, band])


def test_a_jolt_stands_in_its_time_window() -> None:
    error = white(1)
    error[2300:2350] += 40 * NOISE
    (one,) = mapped(compared(error)).by_time
    window = int(np.nanargmax(one.ratio[0]))
    assert one.edges[window] <= 2.3 < one.edges[window + 1]
    assert np.nanmax(np.delete(one.ratio[0], window)) < 1.5


def test_what_does_not_count_is_in_no_cell() -> None:
    error = white(2)
    error[1000:1500] = 1.0
    counted = np.ones(3000, dtype=bool)
    counted[1000:1500] = False
    maps = mapped(compared(error, counted=counted))
    (one,) = maps.by_time
    assert np.all(np.isnan(one.ratio[0, 4:6]))
    assert np.nanmax(one.ratio) < 1.0 + SPREAD


def test_a_time_window_of_ten_samples_has_an_rms_and_one_of_seven_has_none() -> None:
    assert np.isfinite(mapped(compared(white(5, 12 * 10 * DT))).by_time[0].rms).all()
    assert np.isnan(mapped(compared(white(5, 12 * 7 * DT))).by_time[0].rms).all()


def test_a_slow_camera_is_mapped_up_to_its_own_half_rate() -> None:
    counted = np.zeros(3000, dtype=bool)
    counted[::10] = True
    (one,) = mapped(compared(white(3)), compared(white(4), "slow", counted=counted)).by_frequency
    slow = np.isfinite(one.ratio[1])
    assert one.edges[:-1][slow].max() < 50.0
    assert np.all(np.isnan(one.ratio[1, one.edges[:-1] >= 50.0]))
    np.testing.assert_allclose(one.ratio[1, slow], 1.0, rtol=2 * SPREAD)


def test_the_worst_cells_are_ten_and_in_order() -> None:
    maps = mapped(*(compared(white(k) * (k + 1), n) for k, n in enumerate(RECORDINGS)))
    ratios = [cell.ratio for cell in maps.worst]
    assert len(ratios) == 10
    assert ratios == sorted(ratios, reverse=True)
    everything = np.concatenate([m.ratio.ravel() for m in (*maps.by_time, *maps.by_frequency)])
    assert ratios[0] == np.nanmax(everything)
    assert worst_cells((), 10) == ()


@given(st.floats(5.0, 1e4), st.floats(0.05, 100.0))
def test_bands_are_octaves_that_cover_everything(highest: float, seconds: float) -> None:
    edges = bands(highest, seconds)
    assert edges[0] == 0.0
    assert edges[-1] == highest
    assert np.all(np.diff(edges) > 0.0)
    np.testing.assert_allclose(edges[2:] / edges[1:-1], 2.0)


def test_without_floors_the_noise_in_the_error_is_the_floor() -> None:
    slow = 30 * NOISE * np.sin(2 * np.pi * 1.5 * DT * np.arange(3000))
    recordings = [compared(white(k) + slow, n) for k, n in enumerate(RECORDINGS)]
    assert noise_floors(recordings)["z1"] == pytest.approx(NOISE, rel=0.1)
    assert error_maps(recordings).by_time[0].floor[0, 0] == noise_floors(recordings)["z1"]


def moving() -> JointMotion:
    t = DT * np.arange(3000)
    place = np.column_stack([0.3 * np.sin(5.0 * t), 0.2 * np.cos(3.1 * t)])
    rate = np.gradient(place, DT, axis=0)
    return JointMotion(place, rate, np.gradient(rate, DT, axis=0), 0.01 * place[:, ::-1],
                       ("rad", "rad"))  # fmt: skip


def test_a_step_at_zero_velocity_shows_as_friction_of_that_joint() -> None:
    motion = moving()
    error = white(5) + 10 * NOISE * np.sign(motion.velocity[:, 1])
    maps = mapped(compared(error, motion=motion))
    best = maps.over[0]
    assert (best.quantity, best.joint, best.quantity_unit) == ("velocity", 2, "rad/s")
    assert best.explained > 0.9
    forwards, backwards = best.mean
    assert np.nanmin(forwards) == pytest.approx(10 * NOISE, rel=0.2)
    assert np.nanmax(backwards) == pytest.approx(-10 * NOISE, rel=0.2)


def test_every_sample_is_in_one_cell_of_each_direction() -> None:
    motion = moving()
    counted = np.random.default_rng(1).random(3000) > 0.2
    maps = mapped(compared(white(6), counted=counted, motion=motion))
    assert len(maps.over) == 4 * 2
    for one in maps.over:
        assert one.count.sum() == counted.sum()
        backwards = (motion.velocity[counted, one.joint - 1] < 0.0).sum()
        assert one.count[1].sum() == backwards
        assert one.explained < 0.1


def test_a_recording_without_motion_has_maps_and_nothing_over_the_motion() -> None:
    maps = mapped(replace(compared(white(7)), motion=None))
    assert maps.over == ()
    assert maps.by_time and maps.by_frequency


def test_channels_without_a_floor_are_left_out() -> None:
    both = replace(
        compared(white(8)), channels=(*compared(white(8)).channels,
                                      *compared(white(9), channel="ydot1").channels)
    )  # fmt: skip
    assert {m.channel for m in mapped(both).by_time} == {"z1"}
