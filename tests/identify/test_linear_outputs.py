"""The linear model's outputs for many vectors at once are the plain predictions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.effects import catalogue
from flexgui.core.identify.linear_outputs import POSTURE_TOLERANCE, LinearOutputs, applicable
from flexgui.core.identify.residuals import Residuals
from flexgui.core.lanes.wide import LANES
from flexgui.core.recording.recording import CameraPose, LoggerFilter, Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.simulate.experiment import simulate_recording
from flexgui.core.simulate.posture_interpolation import interpolation
from tests.helpers import ARMS, PAPER, loaded, looped, with_modes
from tests.identify.helpers import LPV, residuals_of, simulated, without

EXACT = 1e-9
"""Of a channel's rms: the same response, summed in another order; differences of angles that
grow over the recording lose three digits more."""

FOLLOWED = 5.0 * POSTURE_TOLERANCE
"""Of a channel's rms: what is stated at the start may be some times more a tenth away from it."""

AWAY = 0.1
"""Of the parameters' scale: how far the vectors are from the start."""

SECONDS = 0.3
LINEAR_EFFECTS = sorted(kind for kind, one in catalogue().items() if one.linear)
MODES = looped(with_modes(2, 1), level="lpv")


def recordings(count: int = 3, model: Any = LPV, **spec: Any) -> list[Recording]:
    points = [0.5 + 2.0 * k / max(count - 1, 1) for k in range(count)]
    return simulated(model, points=points, **{"seconds": SECONDS, **spec})


def vectors(residuals: Residuals, size: int) -> np.ndarray:
    start, scales = residuals.unknowns.parameters.vector(), residuals.scales
    moves = np.random.default_rng(size).uniform(-1.0, 1.0, (size, len(start)))
    return start + AWAY * scales * moves


def worst(residuals: Residuals, outputs: LinearOutputs, size: int = 3) -> float:
    """The largest difference to a plain prediction, in units of the channel's rms."""
    points = vectors(residuals, size)
    blocks = outputs.blocks(points)
    found = []
    for s, point in enumerate(points):
        for block, plain in zip(blocks, residuals.predictor.predict(point), strict=True):
            assert block[s].shape == plain.shape
            found.append(np.abs(block[s] - plain).max() / np.sqrt(np.mean(plain**2)))
    return float(max(found))


def outputs_of(residuals: Residuals) -> LinearOutputs:
    assert applicable(residuals.experiments)
    return LinearOutputs(residuals.experiments, residuals.unknowns, residuals.predictor.fixed)


def check(given: list[Recording], bound: float, model: Any = LPV, size: int = 3, **spec: Any):  # type: ignore[no-untyped-def]
    spec = {"parameters": ("EI1", "EI2"), "output": ("ydot",), **spec}
    residuals = residuals_of(model, given, **spec)
    assert worst(residuals, outputs_of(residuals), size) < bound


@pytest.mark.parametrize("output", ["ydot", "y", "z", "encoder", "deflection", ("z", "encoder")])
def test_each_output(output):
    check(recordings(), EXACT, output=output)


@pytest.mark.parametrize("size", [1, 2, LANES, LANES + 1, 3 * LANES - 1])
@pytest.mark.parametrize("count", [1, 3, LANES + 1])
def test_any_number_of_vectors_and_recordings(size, count):
    check(recordings(count, seconds=0.1), EXACT, size=size)


@pytest.mark.parametrize(
    "spec",
    [
        {"filter": ZeroPhaseLowPass(cutoff_hz=50.0)},
        {"output_filter": ZeroPhaseLowPass(cutoff_hz=40.0, order=2)},
        {"decimate": 4},
        {"filter": ZeroPhaseLowPass(cutoff_hz=50.0), "decimate": 3, "output": "z"},
        {"offsets": ("ydot2",)},
        {"parameters": ("EI1", "gain_ydot1")},
        {"parameters": ("EI1",), "start": {"gain_ydot1": 1.2, "offset_ydot2": 0.1}},
        {"initial_state": True},
        {"parameters": ("l1", "lambda2"), "output": ("z", "deflection")},
        {"parameters": ("m1", "EI2"), "per_recording": ("EI2",)},
        {"parameters": ("g1", "EI1"), "output": "ydot"},
    ],
    ids=str,
)
def test_all_that_happens_to_outputs(spec):
    check(recordings(), EXACT, **spec)


@pytest.mark.parametrize(
    "change",
    [
        {"logger_filters": {"ydot1": LoggerFilter(100.0, 0.7)}},
        {"camera": CameraPose(delay=0.0034)},
    ],
    ids=str,
)
def test_what_the_rig_did_to_a_channel(change):
    check([replace(r, **change) for r in recordings()], EXACT)


@pytest.mark.parametrize("held", [0, 2])
def test_central_differences_of_the_tip_beside_recordings_that_hold_the_output(held):
    given = recordings()
    check([*given[:held], *(without(r, "ydot") for r in given[held:])], EXACT)


@settings(max_examples=12)
@given(
    st.lists(st.integers(1, 70), min_size=1, max_size=12),
    st.integers(0, 1000),
    st.sampled_from([(1, 1), (2, 0), (2, 1)]),
)
def test_inputs_that_are_held_for_irregular_times(runs, seed, modes):
    """Each recording with runs of its own, so that neither lengths nor edges agree."""
    model = looped(with_modes(*modes), level="lpv")
    rng = np.random.default_rng(seed)
    held = []
    for r in recordings(2, model, seconds=0.2):
        lengths = rng.permutation(runs)
        rows = np.repeat(rng.normal(size=(len(runs), 2)), lengths, axis=0)
        rows = np.resize(rows, (len(r.time), 2))
        channels = {"dtheta1_ref": rows[:, 0].copy(), "dtheta2_ref": rows[:, 1].copy()}
        held.append(replace(r, channels={**r.channels, **channels}))
    for size in (1, 9):
        check(held, EXACT, model, size=size, parameters=("EI1",))


@pytest.mark.parametrize("kind", ["chirp", "multisine"])
def test_inputs_that_are_not_held(kind):
    check(recordings(excitation=kind), EXACT)


@pytest.mark.parametrize("model", [
    pytest.param(LPV, id="one mode"),
    pytest.param(MODES, id="two modes and one"),
    pytest.param(
        looped(with_modes(2, 3), level="lpv"), id="two and three modes", marks=pytest.mark.long
    ),
])  # fmt: skip
@pytest.mark.parametrize("output", ["ydot", "z", "encoder"])
def test_a_recorded_posture_is_followed_within_the_stated_error(model, output):
    given = recordings(3, model, seconds=0.5)
    moving = [replace(without(r, "ydot"), theta2=None) for r in given]
    residuals = residuals_of(model, moving, parameters=("EI1", "EI2"), output=output)
    outputs = outputs_of(residuals)
    assert set(outputs.errors) == {r.name for r in moving}
    assert max(outputs.errors.values()) < POSTURE_TOLERANCE
    assert worst(residuals, outputs) < FOLLOWED


def test_a_sweep_over_the_elbow_is_followed():
    swept = recordings(1, seconds=1.0, sweep=(0.5, 2.6))
    assert swept[0].theta2 is None
    residuals = residuals_of(LPV, swept, parameters=("EI1", "EI2"), output="ydot")
    assert worst(residuals, outputs_of(residuals)) < FOLLOWED


@pytest.mark.parametrize("kind", LINEAR_EFFECTS)
@pytest.mark.parametrize("moving", [False, True], ids=["working points", "followed"])
def test_effects_that_the_linear_model_can_hold(kind, moving):
    """All that the folder has, at plausible sizes, with their parameters estimated."""
    model = LPV.with_effects([catalogue()[kind]])
    given = [replace(r, theta2=None) if moving else r for r in recordings(2, seconds=0.2)]
    bound = FOLLOWED if moving else EXACT
    names = ("EI1", *model.effect_parameters)
    check(given, bound, model, parameters=names, output=("z", "encoder"))


def test_it_does_not_apply_to_the_non_linear_model():
    residuals = residuals_of(
        looped(PAPER), recordings(1, seconds=0.05), parameters=("EI",), output="ydot"
    )
    assert not applicable(residuals.experiments)


@pytest.mark.parametrize("name", ["0-2-1", "slide", "ground"])
def test_arms_of_other_shapes_are_followed(name):
    """Two angles matter on the chain of three, none or a slide's place on the others."""
    joints = ARMS[name].joints
    model = looped(ARMS[name], level="lpv", gain=20.0)
    spec = SimulateSpec(theta=[0.3, 0.9, -0.7][:joints], seconds=0.3, level="lpv", seed=3)
    moving = replace(simulate_recording(model, spec, "r"), theta2=None)
    check([moving], FOLLOWED, model, parameters=("m1",), output=("z", "encoder"))


def test_with_gravity_the_first_joint_matters_too():
    arm = loaded(ARMS["1-1"], gravity=(0.0, -9.81))
    model = looped(arm, level="lpv")
    moving = [replace(r, theta2=None) for r in recordings(2, model)]
    check(moving, FOLLOWED, model, parameters=("EI1",), output=("z", "encoder"))


@pytest.mark.parametrize("moving", [False, True], ids=["working points", "followed"])
def test_a_servo_whose_references_run_straight_between_samples(moving):
    given = [replace(r, theta2=None) if moving else r for r in recordings(2, seconds=0.2)]
    bound = FOLLOWED if moving else EXACT
    check(given, bound, parameters=("EI1",), output=("z",), servo_hz=5.0)


def test_a_torque_that_a_servo_shows_takes_the_exact_way():
    check(recordings(2, seconds=0.1), EXACT, parameters=("EI1",), output=("torque",))


@settings(max_examples=10)
@given(st.integers(1, 3), st.floats(0.01, 0.5), st.integers(0, 100))
def test_interpolated_matrices_converge_with_the_degree(dimensions, width, seed):
    """On a smooth function of some coordinates, whatever their box."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, dimensions) + width * rng.uniform(-1, 1, (50, dimensions))

    def smooth(q):
        return np.exp(np.sin(q.sum(axis=1) / np.sqrt(dimensions)))

    errors = []
    for degree in (2, 5):
        nodes = interpolation(points, list(range(dimensions)), degree)
        assert nodes.shares.sum(axis=1) == pytest.approx(1.0)
        errors.append(np.abs(nodes.shares @ smooth(nodes.postures) - smooth(points)).max())
    assert errors[1] < 0.2 * errors[0] + EXACT
