"""An effect that stood in for another gives way to it, and a fit that did not find its minimum is
not accepted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from flexgui.core.diagnose.cost_minimum import (
    _start_off_bounds,
    anchor_at,
    converge,
    converge_precisely,
)
from flexgui.core.diagnose.fit_problem import FitProblem, parametrised, with_values
from flexgui.core.diagnose.linear_screen import screen
from flexgui.core.diagnose.removal_and_exchange import _simpler_replacements, best_exchange
from flexgui.core.effects import effect
from flexgui.core.identify.defect_correction import errors_with
from flexgui.core.least_squares import cost_of
from tests.diagnose.test_stated_effects import TRUE, bare

NEVER = lambda: False  # noqa: E731


def exchanged(present: list[str], candidates: list[str]) -> tuple[str, ...] | None:
    """What the model has after an exchange on recordings with viscous friction."""
    effects = [effect(kind) for kind in present]
    start = parametrised(bare().data, effects, bare().base.parametrised.values())
    data, refit = converge(bare().data, start, None, NEVER)
    seen = screen(data, refit.parametrised, effects, [effect(kind) for kind in candidates])
    found = best_exchange(data, refit, effects, 0, seen, NEVER)
    return None if found is None else tuple(e.kind for e in found[1])


def test_a_stand_in_gives_way_to_what_is_true() -> None:
    found = exchanged(["coulomb_friction", "camera_delay"], ["viscous_friction", "torque_offset"])
    assert found == ("viscous_friction", "camera_delay")


def test_one_effect_takes_the_place_of_two_that_imitated_it() -> None:
    """On a single link a wrong loop gain and a wrong mass together were a motor's inertia."""
    found = exchanged(["coulomb_friction", "structural_damping"], ["viscous_friction"])
    assert found == ("viscous_friction",)


def test_what_an_effect_includes_may_stay_where_its_rest_imitated_another() -> None:
    """A soft base beside motors' inertia was an elastic joint, which has such motors."""
    elastic, friction = effect("joint_elasticity"), effect("viscous_friction")
    assert _simpler_replacements([friction, elastic], 0) == [()]
    assert _simpler_replacements([friction, elastic], 1) == [(), (effect("rotor_inertia"),)]
    assert _simpler_replacements([effect("rotor_inertia"), elastic], 1) == [()]


def test_what_is_true_stays() -> None:
    assert (
        exchanged(["viscous_friction"], ["drive_gain", "torque_offset", "coulomb_friction"]) is None
    )


def test_the_last_descent_ends_at_the_minimum() -> None:
    """From a coefficient that is off by some deviations it comes to where another one comes."""
    data: FitProblem = bare().data
    viscous = [effect("viscous_friction")]
    ends = []
    for factor in (0.97, 1.03):
        start = {
            **bare().base.parametrised.values(), "fv1": factor * TRUE, "fv2": factor * TRUE / 2
        }  # fmt: skip
        anchored, refit = converge(data, parametrised(data, viscous, start), None, NEVER)
        ends.append(converge_precisely(anchored, refit, NEVER)[1])
    a, b = (end.parametrised.values()["fv1"] for end in ends)
    at = ends[0].parametrised.unknowns.labels.index("fv1")
    deviation = float(ends[0].covariance[at, at] ** 0.5)
    assert abs(a - b) < 0.1 * deviation


def test_a_stiffness_that_ended_at_its_bound_begins_anew_from_the_nominal_one() -> None:
    data = bare().data
    (nominal,) = [u.parameter for u in data.nuisance if u.parameter.name == "EI"]
    away = parametrised(data, (), {**bare().base.parametrised.values(), "EI": 0.99 * nominal.upper})
    found = _start_off_bounds(data, away, NEVER)
    assert found is not None and found.values()["EI"] == pytest.approx(nominal.value)
    assert _start_off_bounds(data, found, NEVER) is None


CLOSER = 5.0
"""Times nearer to very many steps than the plain errors are, at least: extrapolation gains an order
of the step, and here the steps are such that it is more than ten."""


def test_what_few_steps_miss_is_taken_off_to_a_higher_order() -> None:
    h = bare().base.parametrised
    data, plain = anchor_at(bare().data, h)
    exact = errors_with(h.residuals, h.vector, 128)
    taken_off = with_values(data, h, refine=1).errors(h.vector)

    def apart(errors: Sequence[np.ndarray]) -> float:
        return cost_of([a - b for a, b in zip(errors, exact, strict=True)])

    assert CLOSER**2 * apart(taken_off) < apart(plain)
