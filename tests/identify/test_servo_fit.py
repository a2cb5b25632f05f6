"""Torque-driven rigs: masses from torques, and what the model lacks shows as a torque."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.arm.presets import presets
from flexgui.core.drives.torque import Torque
from flexgui.core.identify.compare import compare
from flexgui.core.identify.setup import make_setup
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.results import MissingTorque
from flexgui.core.scenario.schema import IdentifySpec
from tests.helpers import looped
from tests.identify.helpers import estimate, fit, simulated, with_channels

SLIDE = presets()["single_axis"]
MASS = SLIDE.segments[0].mass
DRIVEN = Model(SLIDE, Torque(), "nonlinear")

SOFT_GAIN = 300.0
"""N s/m. The simulated force jumps with its held reference and is read as straight between
samples; with a soft loop the jumps are small."""

MASS_ERROR = 0.01
"""Relative, asked of a torque fit of simulated data."""

SERVO_ERROR = 0.004
"""Relative; the force's half sample of delay is 0.16 % of it."""


SIZE = 0.1
"""Relative, of a friction that shows: the filter rounds its steps."""

FRICTION = 20.0
"""N, about that of EMPS."""

SETTINGS = {
    "output": ("torque",),
    "servo_hz": 60.0,
    "filter": ZeroPhaseLowPass(cutoff_hz=50.0),
    "decimate": 5,
}


@pytest.fixture(scope="module")
def recording() -> Recording:
    """A slide under a velocity loop; only its force and place are kept."""
    smooth = {"excitation": "multisine", "options": {"highest_hz": 5.0, "periods": 1}}
    loop = looped(SLIDE, SOFT_GAIN)
    found = simulated(loop, points=[0.0], seconds=4.0, amplitude=0.3, **smooth)[0]
    kept = {name: found[name] for name in ("u1", "theta1")}
    ends = (found.time < 0.4) | (found.time > 3.6)  # the start's jump and the filter's ends
    return replace(found, channels=kept, counted={"u1": ~ends})


def speed_of(recording: Recording) -> np.ndarray:
    return np.gradient(recording["theta1"], recording.sample_time)


def missing(recording: Recording, mass: float = MASS, hz: float = 60.0) -> MissingTorque:
    setup = make_setup(DRIVEN, IdentifySpec(**{**SETTINGS, "servo_hz": hz}), [recording])
    found = compare(setup.model, recording, setup.outputs, setup.processing, {"m1": mass}, "all")
    assert len(found.missing_torque) == 1
    return found.missing_torque[0]


def inner(found: MissingTorque) -> slice:
    """Without the filter's ends."""
    return slice(len(found.time) // 10, -len(found.time) // 10)


@pytest.mark.parametrize("hz", [30.0, 60.0, 120.0])
def test_the_mass_does_not_depend_on_the_servo(recording, hz):
    """Its references run straight between samples; what that does to the torque is made good."""
    settings = {**SETTINGS, "servo_hz": hz}
    fitted = fit(DRIVEN, [recording], parameters=("m1",), **settings)
    assert estimate(fitted, "m1").value == pytest.approx(MASS, rel=SERVO_ERROR)


def test_a_torque_constant_is_recovered_from_the_current(recording):
    constant = 8.0
    current = replace(
        recording, channels={"i1": recording["u1"] / constant, "theta1": recording["theta1"]}
    )
    model = Model(SLIDE, Torque(torque_constants=(6.0,)), "nonlinear")
    fitted = fit(model, [current], parameters=("kt1",), **SETTINGS)
    assert estimate(fitted, "kt1").value == pytest.approx(constant, rel=MASS_ERROR)


IDLE = 0.02
"""Of the recorded force, which is read as straight between samples."""


def test_a_perfect_model_lacks_hardly_any_force(recording):
    found = missing(recording)
    part = inner(found)
    assert found.missing[part].std() < IDLE * found.applied[part].std()
    assert (found.joint, found.unit, found.velocity_unit) == (1, "N", "m/s")


def test_a_wrong_mass_shows_as_a_force_along_the_acceleration(recording):
    found = missing(recording, 0.8 * MASS)
    part = inner(found)
    acceleration = np.gradient(found.velocity, found.time)[part]
    slope = found.missing[part] @ acceleration / (acceleration @ acceleration)
    assert slope == pytest.approx(0.2 * MASS, rel=SIZE)


def test_coulomb_friction_shows_as_a_step_over_velocity(recording):
    """The motor overcomes the friction, so its force is larger by F sign(v)."""
    friction = FRICTION * np.sign(speed_of(recording))
    found = missing(with_channels(recording, {"u1": recording["u1"] + friction}))
    part = inner(found)
    v, f = found.velocity[part], found.missing[part]
    fast = 0.5 * np.abs(v).max()
    assert np.median(f[v > fast]) == pytest.approx(FRICTION, rel=SIZE)
    assert np.median(f[v < -fast]) == pytest.approx(-FRICTION, rel=SIZE)


def test_what_a_rigid_arm_lacks_hardly_depends_on_the_servo(recording):
    """No torque is swallowed by a motion that differs from the recorded one."""
    friction = FRICTION * np.sign(speed_of(recording))
    moved = with_channels(recording, {"u1": recording["u1"] + friction})
    for hz in (20.0, 60.0):
        found = missing(moved, hz=hz)
        assert found.missing[inner(found)].std() == pytest.approx(FRICTION, rel=SIZE)
