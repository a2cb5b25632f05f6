"""Whole columns that are wrong are named together, and a model that is off is not taken for one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from flexgui.core.check import column_search
from flexgui.core.check.column_fault import ColumnFault
from flexgui.core.check.comparison import Comparison
from flexgui.core.check.equations import Equation
from flexgui.core.check.finding import Finding
from flexgui.core.check.fitted import fitted
from flexgui.core.check.measured_recording import MeasuredRecording
from flexgui.core.check.run_checks import check_all, check_scenario
from flexgui.core.recording.recording import CameraPose, LoggerFilter, apply_logger_filter
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.scenario.stated_effects import base_model
from tests.check.rigs import SCENARIOS, Rig, rig
from tests.check.test_faults import SIZE
from tests.marks import long_except, long_rows
from tests.programs.studies.checked_rigs import checked_rig

PLACES = ("theta1", "theta2", "dtheta1_ref", "dtheta2_ref")
TEXT = (SCENARIOS / "hidden_friction.toml").read_text()

elastic = cache(lambda: rig(SCENARIOS / "teaching" / "joint_or_link.toml"))


def spoilt(
    found: MeasuredRecording, change: Callable[[str], tuple[str, float]], *names: str
) -> MeasuredRecording:
    """Each of the channels as `factor` times what another one holds."""
    made = {n: f * found.channels[source] for n in names for source, f in [change(n)]}
    return replace(
        found, channels={**found.channels, **made}, headers={n: n for n in found.channels}
    )


def other(name: str) -> tuple[str, float]:
    return name.translate(str.maketrans("12", "21")), 1.0


def alone(found: MeasuredRecording) -> list[Finding]:
    return check_all([found])


def times(factor: float) -> Callable[[str], tuple[str, float]]:
    return lambda name: (name, factor)


SLOW = (
    ("sign", ("theta2",), times(-1.0)),
    ("degrees", PLACES, times(180 / np.pi)),
    ("swapped_joints", (*PLACES, "u1", "u2"), other),
    ("sign", ("dtheta1_ref",), times(-1.0)),
    ("millimetres", ("z1", "z2"), times(1000.0)),
)


@pytest.mark.parametrize(
    "fault, names, change", [("swapped_joints", ("u1", "u2"), other), *long_rows(SLOW)]
)
def test_all_columns_with_a_fault_are_one_finding_with_one_line(
    fault: str, names: tuple[str, ...], change: Callable[[str], tuple[str, float]]
) -> None:
    """On an arm whose joints twist, of which the model knows nothing."""
    (one,) = alone(spoilt(elastic().cases[1].recording, change, *names))
    assert one.fault == fault and one.fix is not None
    assert all(f"{name} = " in one.fix for name in names)


@pytest.mark.long
def test_a_model_that_is_off_is_no_fault_of_its_recordings() -> None:
    """It was said that the sample time is twice the true one, with a worse fit."""
    assert check_all([case.recording for case in elastic().cases]) == []


def test_an_arm_with_stated_elastic_joints_and_base_is_checked_too() -> None:
    """Their coordinates are no bending of a link: this ended with an internal error."""
    found = elastic().cases[0].recording
    effects = "joint_elasticity", "base_compliance"
    stated = "".join(f'{{ id = "{kind}" }}, ' for kind in effects)
    text = TEXT.replace('level = "nonlinear"', f'level = "nonlinear"\neffects = [{stated}]')
    soft = base_model(parse_scenario(text, "soft"))
    assert alone(replace(found, model=soft)) == []


def test_degrees_come_before_gears_where_joints_rub() -> None:
    found = checked_rig(25).cases[1].recording
    said = alone(replace(found, channels={
        **found.channels, "theta1": 180 / np.pi * found.channels["theta1"]
    }))  # fmt: skip
    assert [(one.fault, one.channel) for one in said] == [("degrees", "theta1")]


@pytest.mark.parametrize("factor", long_except((1e3,), (1e3, 1e-3)))
def test_a_stiffness_that_is_stated_in_another_unit_is_named(
    factor: float, rigs: list[Rig]
) -> None:
    text = TEXT.replace('preset = "paper"', f'preset = "paper"\nEI = {520.8333 * factor}')
    stated = replace(rigs[0].cases[0].recording, model=base_model(parse_scenario(text, "stated")))
    (one,) = alone(stated)
    assert (one.fault, one.size) == ("stated_stiffness", pytest.approx(factor))


def test_a_missing_reference_is_named_and_nothing_is_made_of_its_lack(rigs: list[Rig]) -> None:
    found = rigs[0].cases[0].recording
    kept = {n: x for n, x in found.channels.items() if n != "dtheta1_ref"}
    said = alone(replace(found, channels=kept))
    assert [(one.fault, one.channel) for one in said] == [("missing_reference", "dtheta1_ref")]


def test_a_clock_that_runs_backwards_is_named(rigs: list[Rig]) -> None:
    found = rigs[0].cases[0].recording
    (one,) = alone(replace(found, time=found.time[::-1].copy()))
    assert one.fault == "repeated_times"


def test_unequal_rates_and_data_that_were_fitted_are_named(rigs: list[Rig]) -> None:
    found = rigs[0].cases[0].recording
    slow = replace(
        found, name="slow", time=found.time[::5], masks={},
        channels={n: x[::5] for n, x in found.channels.items()},
    )  # fmt: skip
    again = replace(found, name="again", role="validate")
    said = {(one.recording, one.fault) for one in check_all([found, slow, again])}
    assert {("slow", "unequal_rates"), ("again", "same_data")} <= said


def test_an_unknown_parameter_is_named() -> None:
    text = TEXT.replace('"EI1", "EI2"', '"EI1", "E12"').split("[[recordings]]")
    scenario = parse_scenario("[[recordings]]".join(text[:2]), "unknown")
    said = check_scenario(scenario, SCENARIOS)
    assert [(one.fault, one.channel) for one in said] == [("unknown_parameter", "E12")]


def moved(found: MeasuredRecording, **channels: np.ndarray) -> MeasuredRecording:
    """The recording with other values in some channels."""
    return replace(found, channels={**found.channels, **channels})


SLOW_LOGGER = LoggerFilter(frequency=20.0, damping=0.9)
LATE_CAMERA, HIGH_CAMERA = 0.03, 0.05
"""s, and m."""


def logged(found: MeasuredRecording) -> tuple[MeasuredRecording, MeasuredRecording]:
    """A recording after a slow low-pass of the camera, and the same with the low-pass stated."""
    names = ("z1", "z2")
    late = {n: apply_logger_filter(found.channels[n], found.step, SLOW_LOGGER) for n in names}
    unstated = moved(found, **late)
    return unstated, replace(unstated, logger_filters=dict.fromkeys(names, SLOW_LOGGER))


def delayed(found: MeasuredRecording) -> tuple[MeasuredRecording, MeasuredRecording]:
    """The same of a camera that is late."""
    rows = round(LATE_CAMERA / found.step)
    late = {n: x[: -rows if n in ("z1", "z2") else None] for n, x in found.channels.items()}
    channels = {n: x[-len(found.time) + rows :] for n, x in late.items()}
    unstated = replace(found, time=found.time[rows:], channels=channels)
    return unstated, replace(unstated, camera=CameraPose(delay=LATE_CAMERA))


def raised(found: MeasuredRecording) -> tuple[MeasuredRecording, MeasuredRecording]:
    """The same of a camera whose zero is unknown."""
    unstated = moved(found, z2=found.channels["z2"] + HIGH_CAMERA)
    return unstated, replace(unstated, identify=IdentifySpec(offsets=("z2",)))


@pytest.mark.parametrize("change", [delayed, raised])
def test_what_the_scenario_states_of_a_sensor_is_no_fault(
    change: Callable[[MeasuredRecording], tuple[MeasuredRecording, MeasuredRecording]],
    rigs: list[Rig],
) -> None:
    unstated, stated = change(rigs[0].cases[0].recording)
    assert alone(unstated) and alone(stated) == []


def test_a_stated_low_pass_is_passed_by_the_model(rigs: list[Rig]) -> None:
    recordings = logged(rigs[0].cases[0].recording)
    answers = [fitted(of).answer for r in recordings if (of := Comparison.of(r))]
    for channel in ("z1", "z2"):
        unstated, stated = (answer.of(channel)[0].share for answer in answers)
        assert stated < 0.01 < 1.0 < unstated


def test_samples_that_a_correction_takes_out_are_not_explained() -> None:
    time = np.linspace(0.0, 1.0, 100)
    measured = np.where(time < 0.5, np.sin(9.0 * time), np.nan)
    assert Equation("u1", time, measured, measured, 0).share == pytest.approx(0.5, abs=1e-3)


def said_of(found: MeasuredRecording) -> list[tuple[str, str, float]]:
    return [(one.fault, one.channel, one.size) for one in alone(found)]


@pytest.mark.long
@pytest.mark.parametrize("joint", ["theta1", "theta2"])
def test_an_encoder_before_a_gear_is_not_in_degrees(joint: str, rigs: list[Rig]) -> None:
    """A gear of 50 is 57.3 times 0.87, but nothing rubs away 13 % of the motion here."""
    found = rigs[1].cases[1].recording
    said = said_of(moved(found, **{joint: 50.0 * found.channels[joint]}))
    assert said == [("gear_ratio", joint, 50.0)]


@pytest.mark.long
@pytest.mark.parametrize("name", ["dtheta1_ref", "dtheta2_ref"])
def test_a_late_reference_is_a_delay(name: str, rigs: list[Rig]) -> None:
    found, lag = rigs[1].cases[1].recording, 0.02
    x, rows = found.channels[name], round(lag / rigs[1].cases[1].recording.step)
    said = said_of(moved(found, **{name: np.r_[np.full(rows, x[0]), x[:-rows]]}))
    assert said == [("delay", name, pytest.approx(lag, rel=SIZE))]


@pytest.mark.parametrize("joint, jump", [("theta1", 0.1), ("theta2", -0.1)])
def test_an_encoder_that_jumps_is_shifted_from_there_on(
    joint: str, jump: float, rigs: list[Rig]
) -> None:
    found = rigs[1].cases[1].recording
    later = np.arange(found.rows) >= found.rows // 2
    (one,) = alone(moved(found, **{joint: found.channels[joint] + jump * later}))
    assert (one.fault, one.channel, one.size) == ("offset", joint, pytest.approx(jump, rel=SIZE))


@pytest.mark.parametrize("rows", [5, 20])
def test_held_samples_of_a_slow_camera_are_no_samples(rows: int, rigs: list[Rig]) -> None:
    """A delay of half the hold was named, or a limit at the largest value."""
    found = rigs[1].cases[1].recording
    held = {n: found.channels[n][::rows].repeat(rows)[: found.rows] for n in ("z1", "z2")}
    said = said_of(moved(found, **held))
    repeats = found.rows - len(range(0, found.rows, rows))
    assert said == [("dropouts", name, repeats) for name in held]


def test_a_coarse_gauge_at_rest_holds_nothing() -> None:
    coarse = 1e-3 * np.round(8.0 * np.sin(np.linspace(0.0, 9.0, 2000)))
    found = MeasuredRecording("r", "estimate", 1e-3 * np.arange(2000), {"deflection1": coarse})
    assert not found.held("deflection1").any()


torque_driven = cache(lambda: checked_rig(28))


@pytest.mark.long
def test_swapped_torques_are_named_where_torques_drive() -> None:
    (one,) = alone(spoilt(torque_driven().cases[1].recording, other, "u1", "u2"))
    assert one.fault == "swapped_joints" and one.fix is not None


DROWNED = pytest.mark.xfail(strict=True, reason="drowns every answer: nothing is said")


@pytest.mark.long
@pytest.mark.parametrize("factor", [300.0, pytest.param(1e12, marks=DROWNED)])
def test_a_torque_of_an_absurd_size_is_named_where_torques_drive(factor: float) -> None:
    found = torque_driven().cases[1].recording
    said = said_of(moved(found, u1=factor * found.channels["u1"]))
    assert said == [("scale", "u1", pytest.approx(factor, rel=SIZE))]


class Asked:
    """A search of another recording, of which is remembered how often its faults were tried."""

    tried = 0
    faults = (ColumnFault("offset", ("theta1",), shift=0.01),)

    def repeated(self, of: Comparison) -> None:
        type(self).tried += 1


def test_faults_of_the_recordings_before_are_tried_once_each(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each of R recordings tried those of all before it, two simulations each."""
    monkeypatch.setattr(column_search, "fitted", lambda of: SimpleNamespace(answer=None))
    monkeypatch.setattr(column_search, "stated_stiffness", lambda fit: [])
    monkeypatch.setattr(column_search, "_next_step", lambda *_: None)
    column_search.search(cast(Any, None), cast(Any, [Asked() for _ in range(20)]))
    assert Asked.tried == 1
