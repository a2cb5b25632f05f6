"""Where a descent ends, and from where it begins once more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.effects import effect
from flexgui.core.estimate import minimum
from flexgui.core.estimate.minimum import (
    anchor_at,
    converge,
    converge_precisely,
    enough_substeps,
    other_start,
)
from flexgui.core.estimate.problem import FitData, problem_of, with_values
from flexgui.core.identify import defect_correction
from flexgui.core.identify.defect_correction import errors_with
from flexgui.core.identify.residuals import Residuals
from flexgui.core.least_squares import BoundsAndPrior, cost_of, levenberg_marquardt
from tests.diagnose.test_stated_effects import TRUE, bare

NEVER = lambda: False  # noqa: E731

LARGE = 1e3
"""Times the noise."""


def test_a_stated_prior_pulls_the_fit_as_much_as_its_deviation_says() -> None:
    """One parameter measured with deviation 1 at 4 and believed to be 0 within 1: 2."""
    limits = BoundsAndPrior(
        np.array([-9.0]), np.array([9.0]), np.array([1.0]), np.array([0.0]), np.array([1.0])
    )
    found = levenberg_marquardt(
        lambda x: [np.array([[4.0 - x[0]]])],
        lambda _: [np.array([[[-1.0]]])],
        np.array([4.0]),
        limits,
    )
    assert found.vector[0] == pytest.approx(2.0, rel=1e-6)


def test_a_descent_goes_on_after_a_step_that_damping_made_short() -> None:
    """Rosenbrock's valley at a cost of a million: one part in ten thousand of it is still ten times
    the evidence at which two models tie."""
    limits = BoundsAndPrior(np.full(2, -9.0), np.full(2, 9.0), np.ones(2))

    def errors(x: np.ndarray) -> list[np.ndarray]:
        return [LARGE * np.array([[1.0 - x[0]], [100.0 * (x[1] - x[0] ** 2)]])]

    def slopes(x: np.ndarray) -> list[np.ndarray]:
        return [LARGE * np.array([[[-1.0, 0.0]], [[-200.0 * x[0], 100.0]]])]

    found = levenberg_marquardt(errors, slopes, np.array([-1.5, 2.0]), limits, most=200)
    assert found.vector == pytest.approx(np.ones(2), abs=1e-2)


def test_the_last_descent_ends_at_the_minimum() -> None:
    """From a coefficient that is off by some deviations it comes to where another one comes."""
    data: FitData = bare().data
    viscous = [effect("viscous_friction")]
    ends = []
    for factor in (0.97, 1.03):
        start = {
            **bare().base.problem.values(), "fv1": factor * TRUE, "fv2": factor * TRUE / 2
        }  # fmt: skip
        anchored, refit = converge(data, problem_of(data, viscous, start), None, NEVER)
        ends.append(converge_precisely(anchored, refit, NEVER)[1])
    a, b = (end.problem.values()["fv1"] for end in ends)
    at = ends[0].problem.unknowns.labels.index("fv1")
    deviation = float(ends[0].covariance[at, at] ** 0.5)
    assert abs(a - b) < 0.1 * deviation


def test_a_stiffness_that_ended_at_its_bound_begins_anew_from_the_nominal_one() -> None:
    data = bare().data
    (nominal,) = [u.parameter for u in data.nuisance if u.parameter.name == "EI"]
    away = problem_of(data, (), {**bare().base.problem.values(), "EI": 0.99 * nominal.upper})
    found = other_start(data, away, NEVER)
    assert found is not None and found.values()["EI"] == pytest.approx(nominal.value)
    assert other_start(data, found, NEVER) is None


def test_a_stiffness_in_the_middle_of_narrow_bounds_is_not_near_one() -> None:
    data = bare().data
    (nominal,) = [u for u in data.nuisance if u.parameter.name == "EI"]
    value = nominal.parameter.value
    narrow = replace(nominal.parameter, lower=0.96 * value, upper=1.04 * value)
    others = tuple(u for u in data.nuisance if u is not nominal)
    bounded = replace(data, nuisance=(*others, replace(nominal, parameter=narrow)))
    h = problem_of(bounded, (), {**bare().base.problem.values(), "EI": value})
    assert other_start(bounded, h, NEVER) is None


CLOSER = 5.0
"""Times nearer to very many steps than the plain errors are, at least: extrapolation gains an order
of the step, and here the steps are such that it is more than ten."""


def test_what_few_steps_miss_is_taken_off_to_a_higher_order() -> None:
    h = bare().base.problem
    data, plain = anchor_at(bare().data, h)
    exact = errors_with(h.residuals, h.vector, 128)
    taken_off = with_values(data, h, refine=1).errors(h.vector)

    def apart(errors: Sequence[np.ndarray]) -> float:
        return cost_of([a - b for a, b in zip(errors, exact, strict=True)])

    assert CLOSER**2 * apart(taken_off) < apart(plain)


def diverging_below(fewest: int) -> Callable[..., list[np.ndarray]]:
    """Simulations that hold together with so many steps per sample alone."""

    def errors(residuals: Residuals, vector: np.ndarray, steps: int) -> list[np.ndarray]:
        found = errors_with(residuals, vector, steps)
        return found if steps >= fewest else [np.full_like(e, np.nan) for e in found]

    return errors


@pytest.mark.parametrize(("fewest", "wanted"), [(1, 1), (2, 8), (4, 16)])
def test_a_quarter_of_the_steps_holds_together(
    fewest: int, wanted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A screen simulates with so few: with a play on three links it had no number to begin with."""
    data, base = bare().data, bare().base

    enough = enough_substeps(data, (), base.problem.values())
    monkeypatch.setattr(minimum, "errors_with", diverging_below(fewest))
    assert enough_substeps(data, (), base.problem.values()) == max(enough, wanted)


@pytest.mark.parametrize(("fewest", "wanted"), [(1, 1), (4, 4)])
def test_the_steps_of_a_corrected_descent_do_not_diverge(
    fewest: int, wanted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The contacts of a play need more than the joints before it: its slopes were all zero."""
    data, base = bare().data, bare().base

    monkeypatch.setattr(defect_correction, "errors_with", diverging_below(fewest))
    anchored, _ = anchor_at(replace(data, anchored_substeps=1, result_substeps=8), base.problem)
    assert anchored.anchored_substeps == wanted
