"""Loop gains and torque constants that differ from those stated."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.slots import arm_vector
from flexgui.core.drives import build_drive
from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.effects import Rig, effect
from flexgui.core.effects.sizes import typical
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.refinement import refine
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import simulate_recording
from flexgui.core.simulate.nonlinear import simulate_within
from tests.drives.test_contract import OPTIONS
from tests.helpers import PAPER, looped
from tests.identify.helpers import residuals_of

GAIN = effect("drive_gain")
NAMES = {
    "velocity_loop": ("lambda1", "lambda2"),
    "torque": ("kt1", "kt2"),
    "cascade": ("kp1", "kp2", "kv1", "kv2"),
    "state_feedback": ("kt1", "kt2"),
}
KINDS = sorted(NAMES)

SERVO = 0.01
"""Of the torque: a servo of 60 Hz reproduces the inverse-dynamics torque within some per cent, and
this arm's within one."""


def drive(kind: str):  # type: ignore[no-untyped-def]
    return build_drive(kind, OPTIONS[kind])


@pytest.mark.parametrize("kind", KINDS)
def test_its_parameters_are_the_drives_own(kind: str) -> None:
    quantities = GAIN.parameters(PAPER, drive(kind), typical(PAPER))
    own = {item.name: item.value for item in drive(kind).parameters(PAPER)}
    assert tuple(k.parameter.name for k in quantities) == NAMES[kind]
    assert {k.parameter.name: k.neutral for k in quantities} == own
    assert all(0.0 < k.parameter.lower < k.neutral < k.parameter.upper for k in quantities)


@pytest.mark.parametrize("kind", KINDS)
def test_a_drives_parameters_can_be_estimated_without_the_effect(kind: str) -> None:
    spec = IdentifySpec(parameters=NAMES[kind])
    model = Model(PAPER, drive(kind))
    assert [model.parameter(name).value > 0.0 for name in spec.parameters] == [True] * len(
        NAMES[kind]
    )
    known = model.numbers({NAMES[kind][0]: 1.3 * model.parameter(NAMES[kind][0]).value}).law
    assert not np.array_equal(known.R, model.numbers().law.R)


@pytest.mark.parametrize("kind", KINDS)
def test_a_law_at_other_values_is_that_of_a_drive_stated_so(kind: str) -> None:
    p, stated = arm_vector(PAPER), OPTIONS[kind]
    factor = {"velocity_loop": "gains", "cascade": "velocity_gains"}.get(kind, "torque_constants")
    letter = {"velocity_loop": "lambda", "cascade": "kv"}.get(kind, "kt")
    other = {**stated, factor: [1.2 * x for x in stated[factor]]}
    values = {f"{letter}{k + 1}": 1.2 * x for k, x in enumerate(stated[factor])}
    found, expected = drive(kind).law(PAPER, p, values), build_drive(kind, other).law(PAPER, p, {})
    for name in ("R", "P", "V", "S", "Fs", "Fq", "Fv", "Fr", "limit"):
        assert np.allclose(getattr(found, name), getattr(expected, name), rtol=1e-14)


def test_a_drive_that_is_switched_off_has_no_gain_that_could_differ() -> None:
    off = Rig(PAPER, VelocityLoop(gains=(0.0, 0.0)), "nonlinear", ("z",))
    assert "neither a gain" in GAIN.not_applicable(off)
    one = VelocityLoop(gains=(60.0, 0.0))
    assert [k.parameter.name for k in GAIN.parameters(PAPER, one, typical(PAPER))] == ["lambda1"]


FOUND = 1e-4
"""Relative, without noise."""


def test_a_loop_gain_that_is_off_is_found_again() -> None:
    truth = {"lambda1": 42.0, "lambda2": 33.0}
    rig = looped(PAPER).with_effects([GAIN], truth)
    recordings = [simulate_recording(rig, SimulateSpec(theta2=1.2, seconds=0.4), "r")]
    residuals = residuals_of(
        looped(PAPER), recordings, parameters=tuple(truth), output=("encoder",)
    )
    found = refine(residuals, residuals.unknowns.parameters.vector(), lambda cost: False)
    assert found.vector == pytest.approx([42.0, 33.0], rel=FOUND)


def test_a_torque_constant_that_is_off_scales_what_the_current_does() -> None:
    stated = Model(PAPER, Torque(torque_constants=(2.0, 1.0)))
    real = stated.with_effects([GAIN], {"kt1": 1.2, "kt2": 1.0})
    assert np.array_equal(real.numbers().law.R, np.diag([1.2, 1.0]))
    assert Model(PAPER, Torque()).numbers({"kt1": 0.6}).law.R[0, 0] == 0.6


def led(model: Model, channels: dict[str, np.ndarray]) -> Prepared:
    """At 1 kHz, with joints that a servo leads along their encoders."""
    time = np.arange(len(channels["i1"])) * 1e-3
    servo = FollowingServo(model.drive, 60.0, (4.0, 0.8))
    recording = Recording("r", time, channels)
    return prepare(model.steered_by(servo), recording, [sensor("torque")], Processing())


def missing(ready: Prepared, constants: dict[str, float]) -> np.ndarray:
    """(M, 2) of the torque, with torque constants at these values."""
    numbers = ready.model.numbers(constants)
    motion = simulate_within(ready.model, numbers, ready.task_at(constants)).trajectory
    return ready.predicted(motion, numbers, constants) - ready.measured


@pytest.mark.parametrize("values", [{}, {"kt1": 1.2, "kt2": 0.9}], ids=["stated", "estimated"])
def test_under_a_servo_a_known_torque_constant_leaves_no_missing_torque(values) -> None:
    """Whether the constant is an unknown with a value or a size that the model has."""
    truth = {"kt1": 1.2, "kt2": 0.9}
    stated = Model(PAPER, Torque(torque_constants=(2.0, 1.0)))
    t = np.arange(600) * 1e-3
    current = np.column_stack([np.sin(9.0 * t), np.cos(7.0 * t)])
    moved = looped(PAPER)  # any motion of joints will do: they are followed
    place = simulate_recording(moved, SimulateSpec(theta2=1.2, seconds=0.6), "r")
    channels = {"i1": current[:, 0], "i2": current[:, 1]}
    channels |= {name: place[name] for name in ("theta1", "theta2")}
    ready = led(stated.with_effects([GAIN], truth), channels)
    # What is missing is stated in the recorded current's scale, at the stated constants.
    needed = missing(ready, values) * [1.2 / 2.0, 0.9 / 1.0] + current * [1.2, 0.9]
    free = missing(ready, {"kt1": 2.0, "kt2": 1.0}) + current * [2.0, 1.0]
    size = np.sqrt(np.mean(needed**2))
    assert np.abs(needed - free)[5:].max() < SERVO * size


def test_a_smaller_torque_constant_does_not_shrink_an_error_of_the_sensor() -> None:
    """Else any error would be explained away by a motor that gives hardly any torque."""
    model = Model(PAPER, Torque(torque_constants=(2.0, 1.0)))
    noise = 0.1 * np.random.default_rng(1).standard_normal((400, 2))
    still = np.zeros(400)
    channels = {"i1": noise[:, 0], "i2": noise[:, 1], "theta1": still, "theta2": still}
    ready = led(model, channels)
    sizes = [np.std(missing(ready, values)) for values in ({}, {"kt1": 1.0, "kt2": 0.5})]
    assert sizes[1] == pytest.approx(sizes[0], rel=SERVO)
