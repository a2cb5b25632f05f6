"""Lags, clocks and factors are told apart where the stated stiffness is wrong and joints rub."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from flexgui.core.check.case import Case
from flexgui.core.check.checks.limits import DriveSaturated
from flexgui.core.check.checks.missing_samples import Dead
from flexgui.core.check.checks.resolution import quiet_noise
from flexgui.core.check.checks.starts_moving import StartsMoving
from flexgui.core.check.measured_recording import MeasuredRecording
from tests.check.rigs import Rig, rig
from tests.check.test_faults import SIZE
from tests.marks import long_except, long_rows
from tests.programs.sample.torque_rigs import TorqueRig, written
from tests.programs.studies.checked_rigs import checked_rig
from tests.programs.studies.plain_matrix_rigs import drawn

rig_of = cache(checked_rig)


def shifted(
    found: MeasuredRecording, name: str, lag: float, rate: float = 0.0
) -> MeasuredRecording:
    """With a channel that is late by a lag, and by one that grows."""
    t = found.grid
    moved = np.interp(t - lag - rate * (t - t[0]), t, found.even(name))
    return replace(found, channels={**found.channels, name: moved})


def said_of(rig: Rig, spoilt: MeasuredRecording) -> list[tuple[str, str, float]]:
    return [(f.fault, f.channel, f.size) for f in rig.findings(spoilt, 1)]


STIFF = 0.1
"""Of EI: a segment's first resonance to 5 %."""


@pytest.mark.parametrize("seed", long_except((2,), (2, 8, 25)))
def test_the_stiffness_is_found_that_the_scenario_states_wrong(seed: int) -> None:
    """30 % off, with friction in the joints, and four times."""
    search = rig_of(seed).cases[1].search
    assert search is not None
    fit = search.fit
    # The last segment of a stiff arm hardly shows: the first decides on the resonance.
    found, stated = fit.x[0], fit.of.start[0]
    assert found / stated * drawn(seed).starts[0] == pytest.approx(1.0, rel=STIFF)


FRICTIONLESS = ((2, "z2"), (4, "theta1"))
RUBBING = ((25, "z1"), (35, "u2"))


@pytest.mark.parametrize("seed, channel", [*FRICTIONLESS, *long_rows(RUBBING)])
def test_a_late_channel_is_named_whatever_the_stiffness(seed: int, channel: str) -> None:
    """Camera, encoder and torque; 25 and 35 with friction."""
    rig = rig_of(seed)
    found = rig.cases[1].recording
    lag = 9.0 * found.step
    said = said_of(rig, shifted(found, channel, lag))
    of_columns = [one for one in said if one[0] != "quantised"]
    assert of_columns == [("delay", channel, pytest.approx(lag, rel=SIZE))]


def test_a_clock_that_drifts_is_named_whatever_the_stiffness() -> None:
    rig = rig_of(25)
    said = said_of(rig, shifted(rig.cases[1].recording, "z2", 0.0, 7e-3))
    assert said == [("clock_drift", "z2", pytest.approx(7e-3, rel=SIZE))]


@pytest.mark.parametrize("factor", long_except((2.0,), (0.1, 0.5, 2.0, 10.0)))
def test_a_wrong_sample_time_is_named_whatever_the_stiffness(factor: float) -> None:
    rig = rig_of(4)
    found = rig.cases[1].recording
    said = said_of(rig, replace(found, time=factor * found.time))
    assert ("sample_time", "t", factor) in said
    assert {fault for fault, *_ in said} <= {"sample_time", "unequal_rates"}


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


STEP, COUNT, HOLD = 1e-3, 400, 20
SPEED = 0.42
"""rad/s, of a joint that overshoots its reference of 0.3 rad/s."""
SHARE, NOISE = 0.3, 1e-7
"""Of the way to its speed that a joint goes in a sample; rad."""


@pytest.mark.parametrize("left", [2, 4, 10])
def test_the_speed_at_the_start_is_that_before_the_next_step_of_a_reference(left: int) -> None:
    """A fast loop turns the joint around within some samples, `left` samples after the first."""
    sides = np.where(np.arange(COUNT) // HOLD % 2, 1.0, -1.0)
    speed = lfilter([SHARE], [1.0, SHARE - 1.0], SPEED * sides)
    noise = NOISE * np.random.default_rng(left).standard_normal(COUNT)
    place = np.r_[0.0, np.cumsum(speed[:-1] * STEP)] + noise
    cut = slice(5 * HOLD - left, None)
    channels = {"theta1": place[cut], "dtheta1_ref": 0.3 * sides[cut]}
    found = MeasuredRecording("cut", "estimate", STEP * np.arange(COUNT)[cut], channels)
    (one,) = StartsMoving().find(Case(found))
    assert one.channel == "theta1"
    assert one.size == pytest.approx(speed[cut][0], rel=SIZE)


@pytest.mark.long
def test_a_rigid_link_behind_a_soft_joint_is_checked(tmp_path: Path) -> None:
    soft = TorqueRig((3.0,), (0.6,), hub_inertia=0.1, springs=(900.0,), rate=500.0, seconds=2.0)
    path = written(soft, 7, tmp_path)
    text = path.read_text(encoding="utf-8")
    stated = text.replace("modes = 0\n", "modes = 0\njoint_compliance = 1.1e-3\n")
    assert stated != text
    path.write_text(stated, encoding="utf-8")
    checked = rig(path)
    for k in range(soft.recordings):
        assert checked.untouched(k) == []
