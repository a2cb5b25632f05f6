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
from flexgui.core.recording.recording import Recording
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import from_rest

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


def moving(recordings, drive: str) -> list[bool]:  # type: ignore[no-untyped-def]
    references = DRIVES[drive].reference_channels(ARM)
    return [r.in_motion for r in with_beginnings(recordings, 2, references)]


@pytest.mark.parametrize("drive", DRIVES)
def test_a_campaign_from_rest_rests(drive) -> None:
    assert moving(campaign(drive), drive) == [False] * RUNS


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("samples", [1, 20, 37, 61, 110])
def test_a_campaign_that_is_cut_anywhere_moves(drive, samples) -> None:
    """Where a joint turns round its speed tells nothing."""
    assert moving([cut(r, samples + 3 * i) for i, r in enumerate(campaign(drive))], drive) == (
        [True] * RUNS
    )


@pytest.mark.parametrize("drive", DRIVES)
def test_one_that_moves_among_others_at_rest_is_found(drive) -> None:
    recordings = list(campaign(drive))
    recordings[2] = cut(recordings[2], 37)
    assert moving(recordings, drive) == [False, False, True, False]


def test_where_a_smooth_drive_jumps_at_first_the_first_steps_decide() -> None:
    """Nothing like that jump occurs later, so nothing foretells what follows it."""
    assert moving(campaign("torque", smooth=True), "torque") == [False] * RUNS
    later = [cut(r, 40 + 3 * i) for i, r in enumerate(campaign("loop", smooth=True))]
    assert moving(later, "loop") == [True] * RUNS


def test_what_was_not_recorded_is_not_judged() -> None:
    bare = [Recording(r.name, r.time, {"theta1": r["theta1"]}) for r in campaign("loop")]
    assert moving(bare, "loop") == [False] * RUNS
    gaps = [
        Recording(r.name, r.time, {**r.channels, "theta2": np.full(len(r.time), np.nan)})
        for r in campaign("loop")
    ]
    assert moving(gaps, "loop") == [False] * RUNS
    assert with_beginnings([], 2, ("u1",)) == []


def test_joints_that_somebody_leads_are_judged_by_their_first_steps() -> None:
    time = np.arange(200) * STEP
    for begin, moves in ((0.0, False), (0.7, True)):
        place = np.cos(3.0 * (time + begin))
        led = Recording("r", time, {"theta1": place, "theta2": place})
        assert [r.in_motion for r in with_beginnings([led], 2, ())] == [moves]


def test_a_few_samples_say_nothing() -> None:
    short = [cut(r, SAMPLES - 20) for r in campaign("loop")]
    assert moving(short, "loop") == [False] * RUNS
