"""Friction at joints that a virtual servo holds changes its torque and not the motion."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.presets import presets
from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.effects import effect
from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.unknowns import Unknowns
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.sensors import sensor
from flexgui.core.simulate.batch import Job, run_many
from flexgui.core.trajectory import Trajectory

SLIDE = presets()["single_axis"]
BENCH = presets()["two_stage_bench"]
HZ = 60.0
STEP = 2e-3
STEPS = 32
"""Per sample, of the simulation that is the oracle: friction switches within a fraction of one."""

BAND = ZeroPhaseLowPass(cutoff_hz=10.0)
"""Where a servo of 60 Hz takes the joints along: above it reacts to the friction's steps late."""

AGREES = 0.05
"""Of the friction's rms inside the band: a servo of finite stiffness gives way to it a little."""

STIFF_HZ = 1e5
"""A servo that lets the whole torque of a sample through."""

EDGE = 100
"""Samples at both ends, where the filter has none beyond."""


def rig(  # type: ignore[no-untyped-def]
    arm, *effects: str, values: dict[str, float] | None = None, hz: float = HZ
) -> Prepared:
    """The arm with effects, its joints led along smooth swings; no torque was recorded."""
    inertia = (0.35, 0.0095) if arm is BENCH else (SLIDE.segments[0].mass,)
    bare = Model(arm, Torque(), "nonlinear")
    model = bare.with_effects([effect(kind) for kind in effects], values)
    t = np.arange(1500) * STEP
    channels = {}
    for k in range(arm.joints):
        channels[f"theta{k + 1}"] = 0.3 * np.sin((3.0 + k) * t) * np.sin(0.5 * t)
        channels[f"u{k + 1}"] = np.zeros_like(t)
    servo = FollowingServo(model.drive, hz, inertia)
    steered = model.steered_by(servo)
    return prepare(steered, Recording("r", t, channels), [sensor("torque")], Processing())


def predicted(e: Prepared) -> Trajectory:
    found = Predictor([e], Unknowns(()), {}, steps=4).trajectories([(np.zeros(0), [0])])
    return found[0][0][0]


def simulated(e: Prepared) -> Trajectory:
    """With every force in the integrator."""
    return run_many([Job(e.model, e.model.numbers(), e.task)], STEPS)[0]


FRICTION = [
    ("viscous_friction", {"fv1": 2.0, "fv2": 0.3}),
    ("coulomb_friction", {"fc1": 0.6, "fc2": 0.1}),
    ("torque_offset", {"to1": 0.3, "to2": 0.05}),
]


@pytest.mark.parametrize(("kind", "values"), FRICTION, ids=[kind for kind, _ in FRICTION])
def test_friction_evaluated_along_the_motion_is_what_a_simulation_needs(kind, values) -> None:
    with_it, without = rig(BENCH, kind, values=values), rig(BENCH)
    oracle = simulated(with_it).torque - simulated(without).torque
    found = predicted(with_it).torque - predicted(without).torque
    inner = slice(EDGE, -EDGE)
    for k in range(BENCH.joints):
        a, b = (BAND.apply(x[:, k], STEP)[inner] for x in (oracle, found))
        assert np.sqrt(np.mean((a - b) ** 2)) < AGREES * np.sqrt(np.mean(a**2))


def test_friction_at_held_joints_leaves_the_motion_alone() -> None:
    with_it, without = rig(BENCH, "coulomb_friction", values=FRICTION[1][1]), rig(BENCH)
    assert np.array_equal(predicted(with_it).q, predicted(without).q)


def test_a_rigid_arm_needs_the_torque_of_its_inverse_dynamics() -> None:
    e = rig(SLIDE)
    found = predicted(e)
    t = e.task.time
    mass = SLIDE.segments[0].mass
    speed = np.gradient(np.gradient(0.3 * np.sin(3.0 * t) * np.sin(0.5 * t), STEP), STEP)
    inner = slice(EDGE, -EDGE)
    needed = mass * speed[inner]
    assert np.abs(found.torque[inner, 0] - needed).max() < 1e-3 * np.abs(needed).max()


def test_a_loss_that_depends_on_the_torque_itself_is_solved_for() -> None:
    """u = M q'' + l u where the joint is driven, so u = M q'' / (1 - l)."""
    share = 0.25
    losing = rig(SLIDE, "load_friction", values={"ld1": share, "lb1": 0.0}, hz=STIFF_HZ)
    plain, found = predicted(rig(SLIDE, hz=STIFF_HZ)).torque[:, 0], predicted(losing)
    driven = (plain * found.v[:, 0] > 0.0) & (np.abs(found.v[:, 0]) > 0.02)
    driven[:EDGE] = driven[-EDGE:] = False
    assert driven.sum() > EDGE
    assert found.torque[driven, 0] == pytest.approx(plain[driven] / (1.0 - share), rel=1e-6)
