"""A stiffness that a descent left a swing too slow is found along its whole range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from core.arm.arm import Arm
from core.arm.segment import Segment
from core.diagnose.data import Data, hypothesis
from core.diagnose.final_ladder import final_ladder
from core.diagnose.minimum import converged
from core.diagnose.search import search
from core.diagnose.start import Begun
from core.diagnose.state import Options, State, given_step
from core.diagnose.valleys import better_valley, in_the_right_valley
from core.diagnose.verdict import within_noise
from core.drives.velocity_loop import VelocityLoop
from core.effects import effect
from core.effects.sizes import typical
from core.identify.prepared import Processing, prepare
from core.identify.unknowns import Unknown
from core.model import Model
from core.parameters import Parameter
from core.progress import Silent
from core.recording.recording import Recording
from core.sensors import sensor
from core.simulate.motion import Task, at_rest
from core.simulate.nonlinear import simulate_fixed

ARM = Arm(
    segments=(
        Segment(length=0.4, mass=2.0, EI=120.0, hub_inertia=0.02, modes=1),
        Segment(length=0.35, mass=1.2, EI=60.0, hub_inertia=0.01, modes=1),
    )
)
DRIVE = VelocityLoop(gains=(900.0, 500.0))
"""N m s/rad: so stiff that nothing damps the beams."""
TRUTH = {"EI1": 120.0, "EI2": 60.0}
STEP, SAMPLES = 2e-3, 600
STOPS = 40
"""Samples after which the reference stays at zero, and the beams swing freely for a second."""

NOISE = 2e-4
"""m, of the camera; what errors are measured in."""

EXACT = 1e-3
"""Relative, of a stiffness without noise in the recording."""

LACKING = 2e-3
"""m, of something that no stiffness explains."""

LACKING_LITTLE = 1e-4
"""m, of the same: a small part of what the wrong valley leaves."""

SHARP = 0.2
"""Of the noise: so that the little is more than noise."""

SHARPER = 50.0
"""Times the noise: so that the friction is relevant at the wrong minimum."""

WITHIN_NOISE = 1.0
"""Squared error per sample, in noise floors."""

MOVED_BY_IT = 0.05
"""Relative; a stiffness bends a little towards what is missing."""

NOT_THERE = 0.3
"""Relative; the next valley is further than that."""

WRONG = {"EI1": 1.0, "EI2": 2.6}
"""Of the truth: the nominal values, from which descents end in another valley."""


def recorded() -> Recording:
    speeds = np.zeros((SAMPLES, 2))
    speeds[:STOPS] = (0.3, -0.4)
    machine = Model(ARM, DRIVE, "nonlinear")
    n = machine.arm.coordinates
    start = at_rest(np.array([0.2, 1.1]), n)
    task = Task(np.arange(SAMPLES) * STEP, speeds, start, start[None, :n])
    motion = simulate_fixed(machine, machine.numbers(), task, 16)
    names = machine.drive.reference_channels(machine.arm)
    channels = {name: task.references[:, k] for k, name in enumerate(names)}
    camera = sensor("z")
    seen = np.array(camera.measure(motion))
    channels |= {c.name: seen[:, k] for k, c in enumerate(camera.channels(machine.arm))}
    channels |= {f"theta{k + 1}": motion.q[:, k] for k in range(2)}
    return Recording("r", task.time, channels)


@pytest.fixture(scope="module")
def data() -> Data:
    bare = Model(ARM, DRIVE, "nonlinear")
    one = prepare(bare, recorded(), [sensor("z")], Processing())
    nuisance = tuple(
        Unknown(Parameter(name, TRUTH[name] * x, "N m²", 1.0, 1e5)) for name, x in WRONG.items()
    )
    weights, floors = (np.full(2, 1.0 / NOISE),), {"z1": NOISE, "z2": NOISE}
    return Data(bare, (one,), nuisance, weights, floors, {}, typical(ARM), 4)


def apart(values: Mapping[str, float]) -> float:
    """Largest relative error of the stiffnesses."""
    return max(abs(values[name] / x - 1.0) for name, x in TRUTH.items())


def never() -> bool:
    return False


def test_a_stiffness_in_a_wrong_valley_is_found_in_the_right_one(data: Data) -> None:
    """Along that stiffness alone nothing is lower: the first beam, 2 % too soft, hides it."""
    anchored, stands = converged(data, hypothesis(data, (), {}), None, never)
    assert apart(stands.hypothesis.values()) > NOT_THERE
    start = better_valley(anchored, stands.hypothesis, never)
    assert start is not None
    _, found = in_the_right_valley(anchored, stands, never)
    assert found.cost < stands.cost
    assert apart(found.hypothesis.values()) < EXACT


def test_from_the_right_valley_nothing_leads_away(data: Data) -> None:
    anchored, stands = converged(data, hypothesis(data, (), TRUTH), None, never)
    assert better_valley(anchored, stands.hypothesis, never) is None


def lacking_something(data: Data, size: float) -> Data:
    """The same with something in the recording, m, that no stiffness explains."""
    (one,) = data.experiments
    crooked = one.measured + size * np.linspace(0.0, 1.0, SAMPLES)[:, None] ** 2
    return replace(data, experiments=(replace(one, measured=crooked),))


def test_a_valley_is_left_though_the_better_one_does_not_explain_all(data: Data) -> None:
    sharp = replace(data, weights=tuple(w / SHARP for w in data.weights))
    lacking = lacking_something(sharp, LACKING_LITTLE)
    anchored, stands = converged(lacking, hypothesis(lacking, (), {}), None, never)
    there, found = in_the_right_valley(anchored, stands, never)
    assert not within_noise(there, found.errors)
    assert apart(stands.hypothesis.values()) > NOT_THERE
    assert apart(found.hypothesis.values()) < MOVED_BY_IT


def test_while_something_else_is_missing_the_valley_is_not_left(data: Data) -> None:
    """The lowest minimum may then be that of what imitates it."""
    lacking = lacking_something(data, LACKING)
    anchored, stands = converged(lacking, hypothesis(lacking, (), {}), None, never)
    assert better_valley(anchored, stands.hypothesis, never) is not None
    _, found = in_the_right_valley(anchored, stands, never)
    assert found is stands


def test_an_effect_that_was_found_at_a_wrong_minimum_is_weighed_again_at_the_right_one(
    data: Data,
) -> None:
    """Friction that took up a little of what a wrong stiffness leaves is needless at the right
    stiffness, and no step of the ladder stands at the wrong one."""
    sharp = replace(data, weights=tuple(SHARPER * w for w in data.weights))
    sharp = replace(sharp, floors={name: f / SHARPER for name, f in data.floors.items()})
    given, base = converged(sharp, hypothesis(sharp, (), {}), None, never)
    friction = effect("viscous_friction")
    start = hypothesis(given, [friction], base.hypothesis.values())
    begun = Begun(given, base)
    options = Options(max_effects=1, candidates=(friction.kind,))
    there = converged(given, start, None, never)
    state = State(*there, [friction], 0, [], [given_step(begun)], None)
    assert apart(there[1].hypothesis.values()) > NOT_THERE
    assert not search(state, options, Silent(), None)
    assert not state.found
    state, begun = final_ladder(state, begun, options, Silent())
    assert apart(begun.base.hypothesis.values()) < EXACT
    (step,) = state.steps
    assert step.cost_per_sample < WITHIN_NOISE
    assert [one.accepted for one in state.rounds] == [None]


def test_a_single_unknown_needs_no_other_to_follow(data: Data) -> None:
    alone = replace(data, nuisance=data.nuisance[1:])
    anchored, stands = converged(alone, hypothesis(alone, (), {}), None, never)
    assert stands.hypothesis.unknowns.labels == ("EI2",)
    _, found = in_the_right_valley(anchored, stands, never)
    assert abs(found.hypothesis.values()["EI2"] / TRUTH["EI2"] - 1.0) < EXACT
