"""Lags, clocks and factors are told apart where the stated stiffness is wrong and joints rub."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import butter, cont2discrete, dlsim, sosfiltfilt

from flexgui.core.check.case import Case
from flexgui.core.check.checks.limits import DriveSaturated
from flexgui.core.check.checks.missing_samples import Dead
from flexgui.core.check.checks.resolution import quiet_noise
from flexgui.core.check.inverse_dynamics import loop_gains
from flexgui.core.check.late_channels import late_channel, shape_of
from flexgui.core.check.link_bending import LinkShape, _low_passed, _second_order
from flexgui.core.check.measured_recording import MeasuredRecording
from flexgui.core.check.run_checks import with_true_clock
from tests.check.test_faults import SIZE
from tests.studies.checked_rigs import checked_rig
from tests.studies.plain_matrix_rigs import drawn

EXACT = 1e-9
"""Of the answer: both sides are exact for straight lines between the samples."""
ENDS = 0.02
"""Of the signal, by which two filters may differ that turn its ends about in the same way."""
STIFF = 0.1
"""Of EI: a segment's first resonance to 5 %."""

rig_of = cache(checked_rig)


def seen(found: MeasuredRecording) -> LinkShape:
    shape = shape_of(found)
    assert shape is not None
    return shape


def shifted(
    found: MeasuredRecording, name: str, lag: float, rate: float = 0.0
) -> MeasuredRecording:
    """With a channel that is late by a lag, and by one that grows."""
    t = found.grid
    moved = np.interp(t - lag - rate * (t - t[0]), t, found.even(name))
    return replace(found, channels={**found.channels, name: moved})


def test_a_mode_answers_as_the_exact_discretisation_does() -> None:
    omega, damping, dt = 40.0, 0.02, 2e-3
    x = np.random.default_rng(1).standard_normal(300).cumsum()
    x -= x[0]
    A = np.array([[0.0, 1.0], [-(omega**2), -2 * damping * omega]])
    plant = (A, np.array([[0.0], [omega**2]]), np.array([[1.0, 0.0]]), np.zeros((1, 1)))
    _, y, _ = dlsim(cont2discrete(plant, dt, method="foh"), x)
    found = _second_order(omega, damping, dt, x)
    assert found == pytest.approx(y[:, 0], abs=EXACT * np.abs(y).max())


def test_the_low_pass_is_that_of_butterworth_run_both_ways() -> None:
    x = np.random.default_rng(2).standard_normal((400, 2)).cumsum(axis=0)
    y = sosfiltfilt(butter(3, 0.1, fs=1.0, output="sos"), x, axis=0)
    assert _low_passed(x, 0.1)[30:-30] == pytest.approx(y[30:-30], abs=ENDS * np.std(x))


@pytest.mark.parametrize("seed", [2, 8, 25])
def test_the_stiffness_is_found_that_the_scenario_states_wrong(seed: int) -> None:
    """30 % off, four times, and with friction in the joints."""
    found = seen(rig_of(seed).cases[1].recording)
    # The last segment of a stiff arm hardly shows: the first decides on the resonance.
    assert found.stiffness[0] * drawn(seed).starts[0] == pytest.approx(1.0, rel=STIFF)


@pytest.mark.parametrize("seed, channel", [(2, "z2"), (4, "theta1"), (25, "z1"), (35, "u2")])
def test_a_late_channel_is_named_whatever_the_stiffness(seed: int, channel: str) -> None:
    """Camera, encoder and torque; 25 and 35 with friction."""
    rig = rig_of(seed)
    found = rig.cases[1].recording
    lag = 9.0 * found.step
    late = late_channel(shifted(found, channel, lag))
    assert late is not None
    assert late.cause.channels == (channel,) and not late.cause.grows
    assert late.size == pytest.approx(lag, rel=SIZE)


def test_a_clock_that_drifts_is_named_whatever_the_stiffness() -> None:
    rig = rig_of(25)
    said = rig.findings(shifted(rig.cases[1].recording, "z2", 0.0, 7e-3), 1)
    (one,) = [f for f in said if f.fault == "clock_drift"]
    assert one.channel == "z2" and one.size == pytest.approx(7e-3, rel=SIZE)


@pytest.mark.parametrize("factor", [0.1, 0.5, 2.0, 10.0])
def test_a_wrong_sample_time_is_named_whatever_the_stiffness(factor: float) -> None:
    found = rig_of(4).cases[1].recording
    right, said = with_true_clock(replace(found, time=factor * found.time))
    assert [f.size for f in said] == [factor]
    assert right.recording.time == pytest.approx(found.time)


def test_a_reference_is_its_speed_and_the_torque_over_the_gain() -> None:
    """In a rig whose stated stiffness is 30 % off and whose joints rub."""
    found = rig_of(19).cases[1].recording
    for speed, torque, explained in loop_gains(found, seen(found)):
        assert speed == pytest.approx(1.0, rel=SIZE) and torque == pytest.approx(1.0, rel=SIZE)
        assert explained > 0.95


def test_a_held_torque_between_two_levels_is_no_limit_and_a_cut_off_wave_is() -> None:
    time = 2e-3 * np.arange(1000)
    levels = np.random.default_rng(3).choice([-4.0, 4.0], 50).repeat(20)
    wave = np.clip(5.0 * np.sin(7.0 * time), -4.0, 4.0)
    for torque, count in ((levels, 0), (wave, 1)):
        found = MeasuredRecording("torque", "estimate", time, {"u1": torque})
        assert len(list(DriveSaturated().find(Case(found)))) == count


def test_noise_is_told_from_a_lively_motion() -> None:
    rng = np.random.default_rng(4)
    assert quiet_noise(0.3 * rng.standard_normal(2000)) == pytest.approx(0.3, rel=0.2)
    place = rng.choice([-1.0, 1.0], 500).repeat(2).cumsum()
    assert quiet_noise(place) < 0.1 * np.std(place)


@pytest.mark.parametrize("jump, dead", [(1.0, 0), (40.0, 1)])
def test_a_joint_that_sticks_is_no_dead_channel(jump: float, dead: int) -> None:
    """It leaves by a count of its encoder; a frozen channel jumps to where the joint is."""
    counts = np.r_[np.arange(400) // 2, np.full(60, 199.0), 199.0 + jump + np.arange(400) // 2]
    found = MeasuredRecording("stick", "estimate", 1e-3 * np.arange(860), {"theta1": 1e-4 * counts})
    assert len(list(Dead().find(Case(found)))) == dead
