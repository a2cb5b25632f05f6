"""The exported MJCF, built by MuJoCo: it vibrates, hangs and is driven like the model."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import scipy.linalg

from flexgui.core.arm.chord import chord_matrix
from flexgui.core.effects import effect
from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.results import Outcome
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.nonlinear import simulate_within
from flexgui.core.simulate.posture import Posture, posture
from flexgui.export.formats.mjcf import Mjcf, chain_frequencies
from tests.export.helpers import GRAVITY, MODELS, outcome_of
from tests.helpers import ARMS, chain, loaded, looped, with_modes

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install mujoco")

MODES = 0.01
"""Relative: the required agreement of the first three frequencies, where the model bends in as
many shapes as that takes."""
POLES = 0.01
"""Relative to its size: a pole of the closed loop, damping included."""
MOTION = 0.01
"""Relative: what is measured along a motion, by standard deviations."""
SAMPLE, MOST_STEPS = 1e-3, 20
"""s, and how many steps the engine takes meanwhile."""
TORQUE = 1e-6
"""Relative: the weight of the points that MuJoCo needs, and nothing else."""

EFFECTS = {
    "viscous_friction": {"fv1": 2.0, "fv2": 0.7},
    "coulomb_friction": {"fc1": 0.8, "fc2": 0.3},
    "camera_delay": {"td": 0.004},
    "tip_payload": {"mt2": 0.4},
}


def built(outcome: Outcome):  # type: ignore[no-untyped-def]
    """Model and data of MuJoCo at the posture of the mechanism."""
    model = mujoco.MjModel.from_xml_string(Mjcf().files(outcome)["model.xml"].decode())
    data = mujoco.MjData(model)
    assert outcome.mechanism is not None
    for k, place in enumerate(outcome.mechanism.posture):
        data.qpos[model.joint(f"motor{k + 1}").qposadr[0]] = place
    mujoco.mj_forward(model, data)
    return model, data


def matrices(model, data) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # type: ignore[no-untyped-def]
    """M, K, D (nv, nv) without gravity, the velocity loops in D."""
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    K, D = np.diag(model.jnt_stiffness), np.diag(model.dof_damping)
    for k in range(model.nu):
        joint = model.actuator_trnid[k, 0]
        D[joint, joint] -= model.actuator_biasprm[k, 2]
    return M, K, D


def motors(model) -> list[int]:  # type: ignore[no-untyped-def]
    return [k for k in range(model.njnt) if model.joint(k).name.startswith("motor")]


def first_frequencies(outcome: Outcome) -> np.ndarray:
    """Three, Hz, of the engine's model with the motors held."""
    model, data = built(outcome)
    M, K, _ = matrices(model, data)
    held = [k for k in range(model.nv) if k not in motors(model)]
    inside = np.ix_(held, held)
    squares = scipy.linalg.eigh(K[inside], M[inside], eigvals_only=True)[:3]
    return np.asarray(np.sqrt(squares) / (2 * np.pi))


def at(model: Model, outcome: Outcome) -> Posture:
    assert outcome.mechanism is not None
    return posture(model, np.array(outcome.mechanism.posture))


@pytest.mark.parametrize(
    "arm",
    [
        pytest.param(with_modes(3, 3), id="the paper's"),
        pytest.param(loaded(with_modes(3, 3)), id="loaded"),
        pytest.param(chain(3, 3, 3), id="three segments", marks=pytest.mark.long),
        pytest.param(loaded(chain(3, 3, 3)), id="three loaded segments", marks=pytest.mark.long),
    ],
)
def test_the_first_three_frequencies_are_the_models(arm) -> None:  # type: ignore[no-untyped-def]
    outcome = outcome_of(looped(arm, 20.0))
    assert outcome.mechanism is not None
    assert outcome.mechanism.frequencies == pytest.approx(first_frequencies(outcome), rel=MODES)


@pytest.mark.parametrize("name", ["1-1", "slide", "ground", "0-2-1", "one mode"])
def test_the_frequencies_in_the_header_are_those_of_the_file(name: str) -> None:
    outcome = outcome_of(looped(loaded(ARMS[name]), 20.0))
    assert outcome.mechanism is not None
    stated = chain_frequencies(outcome.mechanism, outcome.mechanism.posture)
    assert stated[:3] == pytest.approx(first_frequencies(outcome), rel=1e-5)


def damped() -> Model:
    """The loaded arm of three modes with friction, payload and soft joints."""
    bare = looped(loaded(with_modes(3, 3)))
    kinds = [effect("viscous_friction"), effect("tip_payload"), effect("joint_elasticity")]
    values = {**EFFECTS["viscous_friction"], **EFFECTS["tip_payload"]}
    return bare.with_effects(kinds, values)


def test_hubs_payload_soft_joints_damping_and_loops_give_the_same_poles() -> None:
    model = damped()
    outcome = outcome_of(model)
    engine, data = built(outcome)
    M, K, D = matrices(engine, data)
    zero, one = np.zeros_like(M), np.eye(len(M))
    theirs = scipy.linalg.eigvals(np.block([[zero, one], [-K, -D]]),
                                  np.block([[one, zero], [zero, M]]))  # fmt: skip
    ours = at(model, outcome).poles
    swinging = sorted(ours[ours.imag > 1.0], key=abs)[:4]
    for pole in swinging:
        assert np.abs(theirs - pole).min() < POLES * abs(pole)


def test_gravity_pulls_with_the_same_torque() -> None:
    model = looped(loaded(with_modes(3, 3), GRAVITY))
    outcome = outcome_of(model)
    engine, data = built(outcome)
    here = at(model, outcome)
    zero = np.zeros(model.arm.coordinates)
    _, force = model.compiled.mass_and_force(here.q, zero, here.numbers.p)
    pulled = -data.qfrc_bias[motors(engine)]
    assert pulled == pytest.approx(force[:2], rel=TORQUE)


def test_limits_and_dry_friction_are_carried_and_the_delay_is_said_to_be_missing() -> None:
    model = looped(ARMS["2-2"])
    values = {name: x for sizes in EFFECTS.values() for name, x in sizes.items()}
    model = model.with_effects([effect(kind) for kind in EFFECTS], values)
    outcome = outcome_of(model)
    text = Mjcf().files(outcome)["model.xml"].decode()
    inside, outside = text.split("NOT in this file")
    for title in ("Coulomb friction (fc1 = 0.8 N m, fc2 = 0.3 N m)", "Viscous", "payload"):
        assert title in " ".join(inside.split())
    assert "Camera delay (td = 0.004 s)" in " ".join(outside.split())
    engine, _ = built(outcome)
    assert list(engine.dof_frictionloss[motors(engine)]) == pytest.approx([0.8, 0.3])
    assert list(engine.dof_damping[motors(engine)]) == pytest.approx([2.0, 0.7])


def test_it_moves_and_measures_like_the_simulation_in_no_more_steps_than_that_takes() -> None:
    model = damped()
    outcome = outcome_of(model)
    engine, data = built(outcome)
    spec = SimulateSpec(theta2=np.pi / 2, seconds=0.5, sample_time=SAMPLE, seed=3)
    task = make_task(model, spec, "x")[0]
    expected = simulate_within(model, model.numbers(), task).trajectory
    steps = round(SAMPLE / engine.opt.timestep)
    assert steps * engine.opt.timestep == pytest.approx(SAMPLE) and steps <= MOST_STEPS
    named = ("theta1", "theta2", "dtheta2", "u1", "deflection1", "deflection2")
    found = np.empty((len(task.time), len(named) + 2))
    for row, references in zip(found, task.references, strict=True):
        data.ctrl[:] = references
        mujoco.mj_forward(engine, data)
        row[:] = [*(data.sensor(name).data[0] for name in named), *data.sensor("z").data[:2]]
        mujoco.mj_step(engine, data, steps)
    theirs = (
        expected.q[:, :2], expected.v[:, 1:2], expected.torque[:, :1],
        expected.q @ chord_matrix(model.arm, expected.p).T, expected.tip()[0],
    )  # fmt: skip
    for column, other in zip(found.T, np.column_stack(theirs).T, strict=True):
        assert np.std(column - other) < MOTION * np.std(other)


@pytest.mark.parametrize("name", list(MODELS))
def test_every_arm_is_built_by_the_engine_and_seen(name: str) -> None:
    engine, _ = built(outcome_of(MODELS[name]))
    assert len(motors(engine)) == MODELS[name].arm.joints
    seen = {int(body) for body in engine.geom_bodyid}
    assert {k for k in range(1, engine.nbody) if engine.body_mass[k] > 1e-6} <= seen


def test_an_elastic_base_is_one_for_all_that_stands_on_the_ground() -> None:
    bare = looped(ARMS["ground"], 20.0)
    model = bare.with_effects([effect("base_compliance")])
    engine, _ = built(outcome_of(model))
    slides = [k for k in range(engine.njnt) if engine.jnt_stiffness[k] and engine.jnt_type[k] == 2]
    assert len(slides) == 2


def test_a_turning_base_swings_as_in_the_model() -> None:
    model = looped(with_modes(3, 3), 20.0).with_effects([effect("base_rotation")])
    outcome = outcome_of(model)
    engine, _ = built(outcome)
    assert engine.joint("pedestal").stiffness[0] > 0.0
    assert outcome.mechanism is not None
    assert outcome.mechanism.frequencies == pytest.approx(first_frequencies(outcome), rel=MODES)


def test_a_title_cannot_leave_its_comment_and_a_missing_mechanism_is_told() -> None:
    assert Mjcf().unable(replace(outcome_of(MODELS["torque"]), mechanism=None))
    outcome = outcome_of(MODELS["torque"], title="evil --> <worldbody/> --")
    root = ElementTree.fromstring(Mjcf().files(outcome)["model.xml"])
    assert [child.tag for child in root][-4:] == ["worldbody", "tendon", "actuator", "sensor"]


def test_rigid_links_have_the_mass_matrix_and_weight_of_the_model() -> None:
    stated = {"centre_of_mass": 0.11, "centre_of_mass_across": -0.04, "inertia": 0.2}
    pair = loaded(ARMS["rigid pair"], GRAVITY)
    links = tuple(s.model_copy(update=stated) for s in pair.segments)
    model = looped(pair.model_copy(update={"segments": links}))
    outcome = outcome_of(model)
    engine, data = built(outcome)
    here = at(model, outcome)
    M, F = model.compiled.mass_and_force(here.q, np.zeros(2), here.numbers.p)
    assert matrices(engine, data)[0] == pytest.approx(M, rel=TORQUE)
    assert -data.qfrc_bias == pytest.approx(F, rel=TORQUE)
