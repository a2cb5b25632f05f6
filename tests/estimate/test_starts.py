"""A soft base whose resonance a beam's stiffness has taken is found from the first swings, and
whatever else a refit begins from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.segment import Segment
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.effects import Effect, effect
from flexgui.core.effects.base_compliance import compliance
from flexgui.core.effects.sizes import typical
from flexgui.core.estimate.fit_result import fit
from flexgui.core.estimate.minimum import other_start
from flexgui.core.estimate.problem import FitData, Problem, problem_of
from flexgui.core.estimate.starts import (
    GRID_RATIO,
    Horizon,
    Values,
    grids,
    profile_costs,
    starts,
)
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.unknowns import Unknown
from flexgui.core.model import Model
from flexgui.core.parameters import Parameter
from flexgui.core.recording.recording import Recording
from flexgui.core.sensors import sensor
from tests.helpers import from_rest, read, simulate_fixed

ARM = Arm(
    segments=(
        Segment(length=0.32, mass=2.3, EI=268.0, hub_inertia=0.017, modes=1),
        Segment(length=0.34, mass=1.6, EI=194.0, hub_inertia=0.012, modes=1),
    )
)
DRIVE, BASE = VelocityLoop(gains=(4.9, 1.7)), effect("base_compliance")
SOFT_HZ = 46.0
"""Of the arm's mass on its base, beside the second beam's own vibration."""


STEP, SAMPLES, HOLD = 1e-3, 1000, 14
"""s; the base swings 46 times."""

NOISE = 1e-5
"""rad, of the encoders; here what errors are measured in, none is added."""

BENT = {"EI1": 1.03, "EI2": 0.6}
"""Where a fit without the soft base ended on such a rig, of the truth."""

FOUND = 0.1
"""Relative, of a start; a refit goes on from here."""

TRUTH = {"EI1": 268.0, "EI2": 194.0, "cb": compliance(ARM, SOFT_HZ)}


def recorded(hidden: Effect, sizes: Mapping[str, float]) -> Recording:
    rng = np.random.default_rng(7)
    speeds = 0.3 * np.repeat(rng.choice([-1.0, 1.0], (-(-SAMPLES // HOLD), 2)), HOLD, axis=0)
    machine = Model(ARM, DRIVE, "nonlinear").with_effects([hidden], sizes)
    task = from_rest(machine, [0.2, 1.1], speeds[:SAMPLES], STEP)
    return read(machine, task, simulate_fixed(machine, machine.numbers(), task, 16), "encoder")


@pytest.fixture(scope="module")
def data() -> FitData:
    return data_of(BASE, cb=TRUTH["cb"])


def stiffnesses(shares: Mapping[str, float]) -> tuple[Unknown, ...]:
    """Of the true ones."""
    return tuple(
        Unknown(Parameter(name, TRUTH[name] * x, "N m²", 1.0, 1e5)) for name, x in shares.items()
    )


def data_of(hidden: Effect, **sizes: float) -> FitData:
    bare = Model(ARM, DRIVE, "nonlinear")
    one = prepare(bare, recorded(hidden, sizes), [sensor("encoder")], Processing())
    nuisance = stiffnesses(BENT)
    floors = {"theta1": NOISE, "theta2": NOISE}
    weights = (np.full(2, 1.0 / NOISE),)
    return FitData(bare, (one,), nuisance, weights, floors, {}, typical(ARM), 2)


def apart(values: Mapping[str, float]) -> float:
    return max(abs(values[name] / true - 1.0) for name, true in TRUTH.items())


def bent(data: FitData) -> Problem:
    return problem_of(data, [], {})


def test_the_first_swings_tell_the_base_from_the_beam(data: FitData) -> None:
    before = bent(data)
    begun = {**before.values(), "cb": compliance(ARM, 60.0)}
    first, found = starts(data, before, [BASE], begun, ["cb"], lambda: False)
    assert first == begun and apart(found) < FOUND
    there = fit(problem_of(data, [BASE], found), None, lambda: False, 10)
    plain = fit(problem_of(data, [BASE], begun), None, lambda: False, 10)
    assert there.cost < 0.1 * plain.cost  # or there was nothing to escape from


@pytest.mark.parametrize("hz", [11.0, 21.0, 43.0, 85.0])
def test_a_base_between_two_sizes_of_the_grid_is_among_the_starts(hz: float) -> None:
    """The sizes that the screen tries are a factor of four apart; the valley is a tenth wide."""
    size = compliance(ARM, hz)
    recording = replace(data_of(BASE, cb=size), nuisance=stiffnesses({"EI1": 1.0, "EI2": 1.0}))
    near = valleys(recording, 1 / 4, {"cb": compliance(ARM, 15.0)})
    assert min(abs(np.log(one["cb"] / size)) for one in near) < np.log(GRID_RATIO)


def valleys(data: FitData, share: float, at: Values) -> list[Values]:
    """The sizes of the base whose cost is below that of their neighbours."""
    horizon = Horizon(data, [BASE], share, (), lambda: False)
    found = horizon.local_minima({**bent(data).values(), **at}, grids(data, [BASE], ["cb"]))
    return [values for _, values in found]


@pytest.mark.parametrize("beams", [{"EI1": 1.1, "EI2": 1.1}, BENT])
def test_a_base_is_among_the_starts_where_the_beams_stand_wrong(
    data: FitData, beams: dict[str, float]
) -> None:
    """With the beams held where they stand the cost has no valley at the size that is true."""
    recording = replace(data, nuisance=stiffnesses(beams))
    near = valleys(recording, 1 / 16, {"cb": compliance(ARM, 240.0)})
    assert min(abs(np.log(one["cb"] / TRUTH["cb"])) for one in near) < np.log(GRID_RATIO)


def test_what_does_not_swing_begins_where_the_model_stands_and_at_the_nominal_values(
    data: FitData,
) -> None:
    known = stated(data, AWAY)
    wrong = problem_of(known, [], {name: TRUTH[name] * x for name, x in BENT.items()})
    tried = starts(known, wrong, [effect("viscous_friction")], {"fv1": 0.1}, [], lambda: False)
    arms = [{n: one[n] / TRUTH[n] for n in ("EI1", "EI2")} for one in tried]
    assert arms == [pytest.approx(BENT), pytest.approx({"EI1": AWAY, "EI2": AWAY})]
    assert all(one["fv1"] == 0.1 for one in tried)


def test_who_stops_gets_what_was_compared_so_far(data: FitData) -> None:
    h = problem_of(data, [BASE], {"cb": TRUTH["cb"]})
    assert profile_costs(h, [0], [h.vector] * 3, lambda: True) == []


def stated(data: FitData, share: float) -> FitData:
    """With both stiffnesses stated at a share of the truth."""
    nuisance = tuple(
        replace(u, parameter=replace(u.parameter, value=share * TRUTH[u.label]))
        for u in data.nuisance
    )
    return replace(data, nuisance=nuisance)


AWAY = 1.1
"""Times the truth: where a data sheet may well be."""


def test_a_complete_model_in_a_wrong_valley_is_led_out_of_it_by_the_nominal_values(
    data: FitData,
) -> None:
    known = stated(data, AWAY)
    wrong = {name: TRUTH[name] * x for name, x in BENT.items()}
    values = {**wrong, "cb": compliance(ARM, 60.0)}
    stuck = fit(problem_of(known, [BASE], values), None, lambda: False, 10).problem
    assert apart(stuck.values()) > FOUND  # or there was nothing to escape from
    found = other_start(known, stuck, lambda: False)
    assert found is not None and apart(found.values()) < FOUND


def test_there_is_no_other_start_at_the_nominal_values_or_at_the_minimum(data: FitData) -> None:
    at = problem_of(stated(data, 1.0), [BASE], TRUTH)
    assert other_start(stated(data, 1.0), at, lambda: False) is None
    assert other_start(stated(data, AWAY), at, lambda: False) is None


def test_one_joint_may_be_much_softer_than_the_next() -> None:
    """Along the sizes of all joints together no place is near both."""
    true = {"c1": 1e-4, "c2": 1.5e-2}
    joints = effect("joint_elasticity")
    known = stiffnesses({"EI1": 1.0, "EI2": 1.0})
    data = replace(data_of(joints, **true), nuisance=known)
    horizon = Horizon(data, [joints], 1 / 16, (), lambda: False)
    sizes = grids(data, [joints], ["c1", "c2"])
    smallest = {name: grid[0] for name, grid in sizes.items()}
    found = horizon.local_minima({**bent(data).values(), **smallest}, sizes)
    cost, best = min(found, key=lambda end: end[0])
    assert cost < horizon.first.count  # within the noise
    for name, x in true.items():
        assert abs(np.log(best[name] / x)) < np.log(GRID_RATIO)
