"""A size at the bound of what is plausible, and what the recordings say of it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from flexgui.core.diagnose.judgement import at_bounds, indistinct, reduction_beyond_bound
from flexgui.core.effects import effect
from flexgui.core.effects.sizes import typical
from flexgui.core.estimate.fit_result import FitResult, fit, robust_covariance
from flexgui.core.estimate.minimum import converge
from flexgui.core.estimate.problem import FitData, problem_of
from flexgui.core.least_squares import (
    BoundsAndPrior,
    bounds_and_prior,
    cost_of,
    levenberg_marquardt,
)
from flexgui.core.parameters import Parameter, ParameterSet
from flexgui.core.results import Objection, Reason
from tests.diagnose.test_stated_effects import bare, begun
from tests.helpers import PAPER, looped

EXACT = 1e-8
"""Relative: two ways to the same least squares of a few well-conditioned columns."""


def linear(seed: int, lower: float, upper: float) -> tuple[SimpleNamespace, float]:
    """A straight-line problem of three unknowns, of which the last has bounds, at its minimum; and
    the cost without these bounds."""
    rng = np.random.default_rng(seed)
    S, y = rng.standard_normal((40, 2, 3)), rng.standard_normal((40, 2))
    errors = lambda x: [y + S @ x]  # noqa: E731
    limits = BoundsAndPrior(np.array([-9.0, -9.0, lower]), np.array([9.0, 9.0, upper]), np.ones(3))
    found = levenberg_marquardt(
        errors, lambda _: [S], np.array([0.0, 0.0, 0.5 * (lower + upper)]), limits
    )
    free, *_ = np.linalg.lstsq(S.reshape(-1, 3), -y.ravel(), rcond=None)
    at = SimpleNamespace(limits=limits, vector=found.vector)
    found = replace(found, slopes=(S,), blocks=tuple(errors(found.vector)))
    return SimpleNamespace(problem=at, descended=found), float(free[2])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("side", [-1, 1])
def test_what_a_bound_costs_is_what_least_squares_without_it_saves(seed: int, side: int) -> None:
    _, free = linear(seed, -9.0, 9.0)
    bounds = (free + 0.1, free + 5.0) if side < 0 else (free - 5.0, free - 0.1)
    at, _ = linear(seed, *bounds)
    S, (block,) = at.descended.slopes[0].reshape(-1, 3), at.descended.blocks
    rest, *_ = np.linalg.lstsq(S, -block.ravel(), rcond=None)
    saved = cost_of([block]) - cost_of([block + (S @ rest).reshape(block.shape)])
    assert reduction_beyond_bound(at, 2) == pytest.approx(saved, rel=EXACT)


def test_a_bound_that_nothing_presses_costs_nothing() -> None:
    at, free = linear(0, -9.0, 9.0)
    at.problem.vector[2] = at.problem.limits.upper[2] = free + 0.1
    at.descended = replace(
        at.descended, blocks=(at.descended.blocks[0] + 0.1 * at.descended.slopes[0][..., 2],)
    )
    assert reduction_beyond_bound(at, 2) == 0.0


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e9])
@pytest.mark.parametrize("lower", [-np.inf, -2.0])
@pytest.mark.parametrize("upper", [np.inf, 5.0])
def test_only_a_value_next_to_a_finite_bound_is_at_a_bound(
    lower: float, upper: float, scale: float
) -> None:
    p = Parameter("x", 0.0, lower=lower * scale, upper=upper * scale, scale=scale)
    limits = bounds_and_prior(ParameterSet((p,)))
    for share in (-2.0, -1.9, 0.0, 4.9, 5.0):
        value = share * scale
        assert p.at_bound(value) == (share in (lower, upper))
        assert p.at_bound(value) != limits.inside(np.array([value]))[0]


def pressed(upper: float) -> tuple[FitData, FitResult]:
    """The arm with viscous friction of 6 N m s/rad in joint 1, of which at most `upper` is
    allowed, as if that were the bound of what is plausible."""
    found = begun(fv1={"start": 5.0, "upper": upper}, fv2=3.0)
    return replace(found.data, bounded=frozenset()), found.base


def test_a_size_that_the_recordings_want_beyond_its_bound_is_said_with_the_bound() -> None:
    data, found = pressed(5.5)
    [(kind, objection)] = at_bounds(found, data, bare().base)
    assert kind == "viscous_friction" and (objection.bound, objection.unit) == (5.5, "N m s/rad")


def test_a_bound_that_a_person_stated_refuses_nothing() -> None:
    data, found = pressed(5.5)
    assert at_bounds(found, replace(data, bounded=frozenset({"fv1"})), bare().base) == []


def test_a_bound_that_the_model_before_stood_at_says_nothing_of_what_was_added() -> None:
    data, found = pressed(5.5)
    assert at_bounds(found, data, found) == []


def test_a_bound_that_is_not_reached_says_nothing() -> None:
    data, found = pressed(7.0)
    assert at_bounds(found, data, bare().base) == []


def test_how_soon_a_friction_of_no_size_slips_says_nothing() -> None:
    """Its way stands at the largest that is plausible and changes nothing."""
    data = bare().data
    both = [effect("viscous_friction"), effect("presliding_friction")]
    at = {"fv1": 6.0, "fv2": 3.0, "fc1": 0.0, "fc2": 0.0, "zs1": 1e9, "zs2": 1e9}
    h = problem_of(data, both, {**bare().base.problem.values(), **at})
    h = h.at(np.clip(h.vector, h.limits.lower, h.limits.upper))
    found = fit(h, None, lambda: False, most=0)
    assert [n for n, _ in at_bounds(found, data, bare().base)] == []


def test_friction_slips_within_the_travel_of_its_joint() -> None:
    """Of a level, all but 5 % is reached over the longest move that was recorded; where a joint was
    hardly moved, over a degree."""
    sizes = replace(typical(PAPER), travel=np.array([0.3, 0.01]))
    own = effect("presliding_friction").parameters(PAPER, looped(PAPER).drive, sizes)
    ways = [p.parameter for p in own if p.parameter.name.startswith("zs")]
    assert 1.0 - np.exp(-0.3 / ways[0].upper) == pytest.approx(0.95)
    assert ways[1].upper == pytest.approx(np.deg2rad(1.0), rel=0.2)
    assert all(max(p.grid) < p.parameter.upper for p in own if p.grid)


@cache
def fitted(*kinds: str) -> FitResult:
    """The arm with viscous friction, modelled with these effects."""
    data = bare().data
    start = problem_of(data, [effect(k) for k in kinds], bare().base.problem.values())
    return converge(data, start, None, lambda: False)[1]


def objection(kind: str, *others: str) -> Objection | None:
    after = fitted(kind, *others)
    return indistinct(after, [effect(kind)])


def test_a_friction_that_is_there_is_distinct() -> None:
    assert objection("viscous_friction") is None
    assert objection("viscous_friction", "torque_offset") is None


@pytest.mark.parametrize("kind", ["torque_offset", "air_drag"])
def test_what_is_not_there_is_not_distinct_from_zero(kind: str) -> None:
    # As text: a bound that is no number is not equal to itself.
    assert repr(objection(kind, "viscous_friction")) == repr(Objection(Reason.INDISTINCT))


def test_a_size_at_its_bound_has_no_deviation_and_is_left_to_other_rules() -> None:
    there = fitted("viscous_friction")
    h = there.problem
    after = replace(there, problem=h.at(np.minimum(h.vector, h.limits.lower)))
    assert not np.isfinite(np.diag(robust_covariance(after))).any()
    assert indistinct(after, [effect("viscous_friction")]) is None


def test_sizes_that_the_recordings_do_not_determine_are_not_distinct() -> None:
    """One scale of both encoders, of friction and inertia was named on a real robot: -44 %."""
    after = fitted("viscous_friction")
    labels = list(after.problem.unknowns.labels)
    stiffness, sizes = labels.index("EI"), [labels.index(name) for name in ("fv1", "fv2")]
    slopes = [S.copy() for S in after.descended.slopes]
    for S in slopes:
        S[..., sizes] = S[..., [stiffness]]
    blind = replace(after, descended=replace(after.descended, slopes=tuple(slopes)))
    found = indistinct(blind, [effect("viscous_friction")])
    assert found is not None and found.reason is Reason.INDISTINCT
