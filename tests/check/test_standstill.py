"""A joint that nothing moves is no dead channel, and a rough current no outlier."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexgui.core.check.case import Case
from flexgui.core.check.checks.missing_samples import Dead
from flexgui.core.check.checks.outliers import Outliers
from flexgui.core.check.finding import Check
from flexgui.core.check.measured_recording import MeasuredRecording

STEP, ROWS = 0.01, 1200
TIME = STEP * np.arange(ROWS)
FROM, TO = 300, 700
"""Rows in which something stands still: four seconds."""
COUNT = 1e-4
"""rad, of an encoder."""


def said(check: Check, **channels: np.ndarray) -> list[tuple[str, float]]:
    found = MeasuredRecording("r", "estimate", TIME[: len(next(iter(channels.values())))], channels)
    return [(f.channel, f.size) for f in check.find(Case(found))]


def counted(x: np.ndarray) -> np.ndarray:
    return COUNT * np.round(x / COUNT)


def digits(x: np.ndarray) -> np.ndarray:
    """Five of them, as a printed column has: its last one is none of a lattice."""
    return np.array([float(f"{v:.5g}") for v in x])


def resting(until: int, of: int = ROWS) -> np.ndarray:
    """A joint that stands still up to a row, and swings from rest from there on."""
    t = np.clip(TIME[:of] - TIME[until], 0.0, None)
    return 1.0 + 0.4 * (1.0 - np.cos(3.0 * t)) * np.sin(1.0 * t)


@pytest.mark.parametrize("written", [np.asarray, counted, digits], ids=["exact", "counts", "text"])
@pytest.mark.parametrize("backwards", [False, True], ids=["begins", "ends"])
def test_a_joint_that_rests_at_an_end_of_a_recording_is_not_dead(
    written: object, backwards: bool
) -> None:
    place = written(resting(FROM))  # type: ignore[operator]
    torque = 0.02 * np.random.default_rng(1).standard_normal(ROWS)
    torque[FROM:] += np.gradient(np.gradient(resting(FROM)))[FROM:] / STEP**2
    way = slice(None, None, -1 if backwards else 1)
    assert said(Dead(), theta1=place[way], u1=torque[way]) == []


@pytest.mark.parametrize("written", [np.asarray, counted, digits], ids=["exact", "counts", "text"])
@pytest.mark.parametrize("to", [TO, ROWS])
def test_a_sensor_that_freezes_while_its_joint_moves_is_dead(written: object, to: int) -> None:
    """Over a whole period as well, after which it goes on where it stopped."""
    place = np.sin(2.0 * np.pi * (TIME - TIME[FROM]) / (TIME[TO] - TIME[FROM]))
    place[FROM:to] = place[FROM]
    span = pytest.approx((to - FROM) * STEP, rel=0.02)  # a count more or less at the ends
    assert said(Dead(), theta1=written(place)) == [("theta1", span)]  # type: ignore[operator]


@pytest.mark.parametrize("moving", ["theta1_ref", "dtheta1_ref", "u1", "z1"])
def test_a_sensor_that_dies_at_rest_is_dead_where_its_joint_must_move(moving: str) -> None:
    """It comes to rest, and never shows again what a reference, a torque or the camera do."""
    place = resting(FROM)[::-1].copy()
    still = place.copy()
    assert said(Dead(), theta1=place, **{moving: still}) == []
    still[-FROM:] += 0.6 * np.sin(4.0 * TIME[:FROM])
    assert [n for n, _ in said(Dead(), theta1=place, **{moving: still})] == ["theta1"]


def test_a_torque_that_stands_is_dead_only_where_its_joint_moves() -> None:
    place = counted(resting(FROM))
    for at, dead in ((slice(0, FROM), []), (slice(FROM, TO), ["u1"])):
        torque = np.r_[0.02 * np.sin(40.0 * TIME[:FROM]), np.sin(5.0 * TIME[FROM:])]
        torque[at] = torque[at][0]
        assert [n for n, _ in said(Dead(), theta1=place, u1=torque)] == dead


FLIPS = 10
"""Samples of a current at rest that are one count off: too few to be its usual scatter."""


@pytest.mark.parametrize("count", [1.7e-3, 0.05])
def test_single_counts_are_no_outliers_and_many_are(count: float) -> None:
    rng = np.random.default_rng(2)
    at = rng.choice(np.arange(10, ROWS - 10, 7), FLIPS, replace=False)
    current = np.zeros(ROWS)
    current[at] = count * rng.choice([-1.0, 1.0], FLIPS)
    assert said(Outliers(), i1=current) == []
    current[at[:3]] += 30.0 * count
    assert said(Outliers(), i1=current) == [("i1", 3)]


def test_a_current_that_chatters_for_a_moment_has_no_outliers() -> None:
    """It is quiet where its joint rests; one sample that stands out there is one."""
    rng = np.random.default_rng(3)
    current = 0.01 * rng.standard_normal(ROWS)
    current[500:560] += 0.4 * rng.standard_normal(60)
    assert said(Outliers(), i1=current) == []
    current[900] += 5.0
    assert said(Outliers(), i1=current) == [("i1", 1)]


def real(name: str, **columns: str) -> dict[str, np.ndarray]:
    """Channel -> column of a real recording; skips with the reason where it is not."""
    path = Path(os.environ.get("FLEXGUI_DATA", "no folder named")) / name
    if not path.is_file():
        pytest.skip(f"the real recording {name} is not here: FLEXGUI_DATA names no folder with it")
    table = pd.read_csv(path)
    return {channel: table[column].to_numpy(float) for channel, column in columns.items()}


def findings(check: Check, channels: dict[str, np.ndarray], step: float) -> list[tuple[str, float]]:
    rows = len(next(iter(channels.values())))
    found = MeasuredRecording("real", "estimate", step * np.arange(rows), channels)
    return [(f.channel, f.size) for f in check.find(Case(found))]


MERIT = {"theta1": "q2", "theta2": "q3", "i1": "I2", "i2": "I3"}


def test_a_real_arm_that_stands_still_at_first_has_no_dead_channel() -> None:
    """The third joint for 15 s, all for 10 s; columns of five digits."""
    for name in ("merit1", "merit2"):
        assert findings(Dead(), real(f"rigs/{name}.csv", **MERIT), 0.01) == []


def test_a_real_current_that_begins_to_chatter_has_no_outliers() -> None:
    """Of the third joint, by its controller: in the first 20 s, of which it rests for 15."""
    channels = {n: x[:2000] for n, x in real("rigs/merit1.csv", **MERIT).items()}
    assert findings(Outliers(), channels, 0.01) == []


@pytest.mark.parametrize("name", ["20deg", "30deg", "neg_20deg", "neg_30deg"])
def test_a_real_joint_that_has_reached_its_reference_is_not_dead(name: str) -> None:
    columns = {"theta1": "theta1", "theta1_ref": "theta1_ref", "deflection1": "deflection1"}
    assert findings(Dead(), real(f"rigs/ctus_hinf_{name}_run01.csv", **columns), 0.002) == []


def test_a_real_gauge_that_starts_late_is_dead_until_then() -> None:
    names = ("theta1", "theta2", "deflection1", "deflection2")
    channels = real("quanser_2dsfl_steps.csv", **{n: n for n in names})
    late = [("deflection1", pytest.approx(1.004)), ("deflection2", pytest.approx(0.204))]
    assert findings(Dead(), channels, 0.002) == late
