"""Recordings that begin while the arm moves, told from those that begin at rest."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from flexgui.core.arm.presets import presets
from flexgui.core.drives.drive import Drive
from flexgui.core.drives.torque import Torque
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.model import Model
from flexgui.core.recording.initial_motion import with_beginnings
from flexgui.core.recording.recording import Beginning, Recording
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import from_rest
from tests.programs.finite_element_beam import Beam

ARM = presets()["paper"]
STEP, SAMPLES, HOLD, RUNS = 4e-3, 300, 5, 4
COUNT = 2.0 * np.pi / 2**18
"""rad, of an encoder; its links vibrate by less than that at times."""

DRIVES: dict[str, Drive] = {"loop": VelocityLoop(gains=(30.0, 30.0)), "torque": Torque()}
AMPLITUDES = {"loop": (0.3, 0.4), "torque": (3.0, 1.0)}


@cache
def campaign(drive: str, smooth: bool = False) -> tuple[Recording, ...]:
    """All from rest, with noise of half a count."""
    rng = np.random.default_rng(3)
    model = Model(ARM, DRIVES[drive], "nonlinear")
    names = model.drive.reference_channels(ARM)
    found = []
    for i in range(RUNS):
        time = np.arange(SAMPLES) * STEP
        signal = np.repeat(rng.choice([-1.0, 1.0], (SAMPLES // HOLD, 2)), HOLD, axis=0)
        if smooth:
            signal = np.cos(2.0 * np.pi * (1.0 + i + 0.7 * np.arange(2)) * time[:, None])
        signal = signal * AMPLITUDES[drive]
        task = from_rest(model, [0.1, 0.6], signal, STEP)
        moved = simulate_within(model, model.numbers(), task, 1e-7).trajectory.joint_positions
        seen = moved + 0.5 * COUNT * rng.standard_normal(moved.shape)
        channels = {f"theta{k + 1}": COUNT * np.round(seen[:, k] / COUNT) for k in range(2)}
        channels |= {name: signal[:, k] for k, name in enumerate(names)}
        found.append(Recording(f"r{i}", time, channels))
    return tuple(found)


def cut(r: Recording, samples: int) -> Recording:
    channels = {name: x[samples:] for name, x in r.channels.items()}
    return Recording(r.name, r.time[samples:] - r.time[samples], channels)


def beginnings(recordings, drive: str) -> list[Beginning]:  # type: ignore[no-untyped-def]
    references = DRIVES[drive].reference_channels(ARM)
    return [r.beginning for r in with_beginnings(recordings, 2, references, drive == "loop")]


RESTS = {"loop": Beginning.REST, "torque": Beginning.UNKNOWN}
"""Of a campaign from rest: under a torque nothing shows that the links rest too."""


@pytest.mark.parametrize("drive", DRIVES)
def test_a_campaign_from_rest_rests(drive) -> None:
    assert beginnings(campaign(drive), drive) == [RESTS[drive]] * RUNS


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("samples", [1, 20, 37, 61, 110])
def test_a_campaign_that_is_cut_anywhere_moves(drive, samples) -> None:
    """Where a joint turns round its speed tells nothing."""
    parts = [cut(r, samples + 3 * i) for i, r in enumerate(campaign(drive))]
    assert beginnings(parts, drive) == [Beginning.MOTION] * RUNS


@pytest.mark.parametrize("drive", DRIVES)
def test_one_that_moves_among_others_at_rest_is_found(drive) -> None:
    recordings = list(campaign(drive))
    recordings[2] = cut(recordings[2], 37)
    rests = RESTS[drive]
    assert beginnings(recordings, drive) == [rests, rests, Beginning.MOTION, rests]


@pytest.mark.parametrize("drive", DRIVES)
def test_under_smooth_references_nothing_shows_that_an_arm_rests(drive) -> None:
    """Nothing like their first moments occurs later, so nothing tells what follows from rest."""
    whole = campaign(drive, smooth=True)
    for recordings in (whole, [cut(r, 40 + 3 * i) for i, r in enumerate(whole)]):
        assert Beginning.REST not in beginnings(recordings, drive)


def test_a_link_that_vibrates_behind_a_joint_at_rest_is_seen_by_its_gauge() -> None:
    """A loop holds the joint, whose encoder shows nothing; the gauge does."""
    beam = Beam(loop_gain=25.0)
    rng, dt, still = np.random.default_rng(1), 1e-3, 100
    for vibrates in (False, True):
        speed = np.repeat(rng.choice([-0.3, 0.3], 100), 20)
        speed[400 - still : 400] = 0.0
        theta, deflection = beam.motion(speed, dt)
        part = slice(400 if vibrates else 0, None)
        noise = 1e-5 * rng.standard_normal((2, len(speed)))
        channels = {
            "dtheta1_ref": speed[part], "theta1": (theta + noise[0])[part],
            "deflection1": (deflection / beam.length + noise[1])[part],
        }  # fmt: skip
        recording = Recording("r", dt * np.arange(len(speed[part])), channels)
        (judged,) = with_beginnings([recording], 1, ("dtheta1_ref",), held=True)
        assert (judged.beginning is Beginning.REST) != vibrates


def test_what_was_not_recorded_is_taken_to_rest() -> None:
    bare = [Recording(r.name, r.time, {"theta1": r["theta1"]}) for r in campaign("loop")]
    assert beginnings(bare, "loop") == [Beginning.REST] * RUNS
    gaps = [
        Recording(r.name, r.time, {**r.channels, "theta2": np.full(len(r.time), np.nan)})
        for r in campaign("loop")
    ]
    assert beginnings(gaps, "loop") == [Beginning.REST] * RUNS
    assert with_beginnings([], 2, ("u1",), held=False) == []
    short = [cut(r, SAMPLES - 20) for r in campaign("loop")]
    assert beginnings(short, "loop") == [Beginning.REST] * RUNS


def test_joints_that_somebody_leads_are_judged_by_their_first_steps() -> None:
    time = np.arange(200) * STEP
    for begin, beginning in ((0.0, Beginning.UNKNOWN), (0.7, Beginning.MOTION)):
        place = np.cos(3.0 * (time + begin))
        led = Recording("r", time, {"theta1": place, "theta2": place})
        assert [r.beginning for r in with_beginnings([led], 2, (), held=False)] == [beginning]
