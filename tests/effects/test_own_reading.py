"""Formulas of what a sensor's channel reads too much."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import flexgui as fg
from flexgui.core.effects.effect import Rig
from flexgui.core.effects.own_formula import own_parameter
from flexgui.core.effects.own_reading import OwnReading, own_law
from flexgui.core.sensors import sensors
from tests.helpers import PAPER, looped
from tests.marks import long_rows

DT = 1e-3
ROUNDING = 1e-12

FOUND = 0.01
"""Relative, of a size from two noisy recordings of half a second."""


def own(target: str, formula: str, **starts: float) -> OwnReading:
    parameters = tuple(own_parameter(name, value) for name, value in starts.items())
    made = own_law(PAPER, target, formula, parameters, "own_1")
    assert isinstance(made, OwnReading)
    return made


def readings_of(columns: int = 2, seed: int = 0) -> np.ndarray:
    """(N, columns) of places that wander."""
    steps = np.random.default_rng(seed).normal(size=(300, columns))
    return np.asarray(0.7 + 0.02 * np.cumsum(steps, axis=0))


@pytest.mark.parametrize(
    ("target", "formula", "added"),
    [
        ("z1", "a*z1**2", lambda y, t: 0.3 * y[:, 0] ** 2),
        ("z2", "a*z1*z2", lambda y, t: 0.3 * y[:, 0] * y[:, 1]),
        ("theta1", "a*sin(7*theta1)", lambda y, t: 0.3 * np.sin(7.0 * y[:, 0])),
        ("theta2", "a*theta1", lambda y, t: 0.3 * y[:, 0]),
        ("z2", "a*t", lambda y, t: 0.3 * t),
        ("z1", "a", lambda y, t: np.full(len(t), 0.3)),
    ],
)
def test_a_channel_reads_more_by_its_formula_and_the_others_as_they_did(target, formula, added):
    one, y = own(target, formula, a=0.3), readings_of()
    time = DT * np.arange(len(y))
    change = one.sensed(one.sensor, y, DT, {"a": 0.3}) - y
    assert change[:, one.number] == pytest.approx(added(y, time), abs=ROUNDING)
    assert not np.delete(change, one.number, axis=1).any()


@pytest.mark.parametrize("target", ["z1", "theta2", "deflection1"])
def test_other_sensors_read_what_they_read(target: str) -> None:
    one, y = own(target, f"a*{target}", a=0.5), readings_of()
    for kind in sensors():
        read = one.sensed(kind, y, DT, {"a": 0.5})
        assert np.array_equal(read, y) == (kind != one.sensor)


def test_at_a_size_of_nothing_all_is_read_as_it_is() -> None:
    one, y = own("z1", "a*exp(b*z1)", a=0.5, b=2.0), readings_of()
    assert np.array_equal(one.sensed("z", y, DT, {"a": 0.0, "b": 2.0}), y)
    assert [p.parameter.name for p in one.own_parameters if not p.secondary] == ["a"]


def test_what_is_read_before_is_not_what_is_moved() -> None:
    y = readings_of()
    kept = y.copy()
    own("z1", "a*z2", a=1.0).sensed("z", y, DT, {"a": 1.0})
    assert np.array_equal(y, kept)


def test_a_table_is_read_as_that_of_a_force() -> None:
    names = {f"a{k}": float(k**2) for k in range(5)}
    one = own("z1", f"spline(z1, 0, 4, {', '.join(names)})", **names)
    y = np.column_stack([np.arange(5.0), np.zeros(5)])
    assert one.added(y, DT, names) == pytest.approx(list(names.values()), abs=ROUNDING)


@pytest.mark.parametrize(
    ("target", "formula"),
    [("theta1", "a*sin(3*theta1)"), ("theta2", "a*theta1*theta2"), ("theta2", "a*t*theta2")],
)
def test_a_servo_that_follows_an_encoder_stands_where_that_reads_what_it_should(target, formula):
    one, values = own(target, formula, a=0.05), {"a": 0.05}
    asked = readings_of()
    true = one.followed(asked, DT, values)
    assert np.abs(true - asked).max() > 1e-3
    assert one.sensed("encoder", true, DT, values) == pytest.approx(asked, abs=1e-9)
    back = one.followed(one.sensed("encoder", asked, DT, values), DT, values)
    assert back == pytest.approx(asked, abs=1e-9)


def test_a_servo_does_not_follow_a_camera() -> None:
    asked = readings_of()
    assert np.array_equal(own("z1", "a*z1", a=0.5).followed(asked, DT, {"a": 0.5}), asked)


@pytest.mark.parametrize("formula", ["a", "a*sin(3*theta2)", "a*theta1"])
def test_an_arm_starts_where_its_encoder_reads_the_start(formula: str) -> None:
    one, values = own("theta2", formula, a=0.05), {"a": 0.05}
    said = np.array([0.4, 1.1])
    true = one.started(said, values)
    assert one.sensed("encoder", true[None], DT, values)[0] == pytest.approx(said, abs=1e-9)


def test_a_reading_that_is_not_compared_has_no_law() -> None:
    rig = Rig(PAPER, looped(PAPER).drive, "nonlinear", ("encoder",))
    assert own("z1", "a*z1", a=1.0).not_applicable(rig) == "z1 is not compared."
    assert not own("theta1", "a*theta1", a=1.0).not_applicable(rig)
    seen = replace(rig, outputs=("z",), servo=True)
    assert not own("theta1", "a*theta1", a=1.0).not_applicable(seen), "the servo follows it"


NOISE = {"camera_noise": 3e-5, "encoder_noise": 1e-5}
DRIVE = fg.drives.VelocityLoop(gains=(60.0, 30.0))


def recorded(law: dict[str, Any], angles: tuple[float, ...] = (0.9, 1.7)) -> list[dict[str, Any]]:
    """Short recordings of the paper's arm whose sensor has the law."""
    rig = fg.project("paper", DRIVE, sensors=NOISE, model={"level": "nonlinear"})
    machine = rig.with_effects(law)
    tables = [machine.simulate(theta2=x, seconds=0.5, seed=k) for k, x in enumerate(angles)]
    return [{"table": t.to_dataframe(), "name": f"r{k}"} for k, t in enumerate(tables)]


def with_law(law: dict[str, Any], recordings: list[dict[str, Any]]) -> fg.Project:
    return fg.project(
        "paper", DRIVE, recordings, sensors=NOISE, model={"level": "nonlinear", "own": [law]},
        identify={"parameters": ["EI1"], "output": ["z", "encoder"], "generations": 0},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("target", "formula", "size"),
    [("z1", "a*z1**2", 0.02), *long_rows([("theta2", "a*sin(theta2)", 0.02)])],
)
def test_the_size_of_an_error_of_a_sensor_is_identified(target, formula, size) -> None:
    recordings = recorded(fg.formula(target, formula, a=size))
    found = with_law(fg.formula(target, formula, a=0.5 * size), recordings).identify()
    assert found["a"].value == pytest.approx(size, rel=FOUND)
    assert found["EI1"].value == pytest.approx(520.833, rel=FOUND)


@pytest.mark.long
def test_the_arm_of_an_encoder_that_reads_too_much_is_where_the_camera_sees_it() -> None:
    """At the true values nothing but noise is left, from the first sample on."""
    law = fg.formula("theta2", "a*sin(theta2)", a=0.02)
    found = with_law(law, recorded(law, (0.9,))).compare().to_dataframe()
    seen = found[found["channel"].isin(["z1", "z2", "theta1", "theta2"])]
    assert (seen["rms"] < 1e-4).all()
