"""What a descent spends: errors and slopes are counted, for each of them is a simulation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from flexgui.core.least_squares import (
    FIRST_DAMPING,
    WORST_DAMPING,
    BoundsAndPrior,
    Descended,
    levenberg_marquardt,
    predicted_reduction,
)

LIMITS = BoundsAndPrior(np.full(2, -9.0), np.full(2, 9.0), np.ones(2))
SAMPLES = 500
NOISE = 0.1
BENT = 0.02
"""Share of its slope by which an error bends over the way that a descent goes."""


@dataclass
class Curve:
    """Errors (SAMPLES, 1) of a gently bent model on noisy data; what is asked is counted."""

    asked: dict[str, int] = field(default_factory=lambda: {"errors": 0, "slopes": 0})
    t: np.ndarray = field(default_factory=lambda: np.linspace(0.0, 1.0, SAMPLES)[:, None])
    rough: float = 0.0
    """Error of the simulation, different everywhere."""

    def __post_init__(self) -> None:
        rng = np.random.default_rng(2)
        self.y = self.model(np.array([1.0, 2.0])) + NOISE * rng.standard_normal((SAMPLES, 1))

    def model(self, x: np.ndarray) -> np.ndarray:
        straight = x[0] + x[1] * self.t
        return np.asarray(straight + BENT * straight**2)

    def errors(self, x: np.ndarray) -> list[np.ndarray]:
        self.asked["errors"] += 1
        wrong = self.rough * (1.0 + np.sin(1e9 * float(np.sum(x))))
        return [(self.y - self.model(x)) / NOISE + wrong]

    def slopes(self, x: np.ndarray) -> list[np.ndarray]:
        self.asked["slopes"] += 1
        inner = 1.0 + 2.0 * BENT * (x[0] + x[1] * self.t)
        return [np.stack([-inner, -inner * self.t], axis=-1) / NOISE]


def descended(curve: Curve) -> Descended:
    return levenberg_marquardt(curve.errors, curve.slopes, np.zeros(2), LIMITS, good_enough=1e-9)


TIMES = np.linspace(0.0, 1.0, 60)[:, None]
MODELS = {
    "exponential": (lambda x: x[0] * np.exp(-3.0 * x[1] * TIMES), (1.0, 0.8)),
    "two exponentials": (
        lambda x: x[0] * np.exp(-x[1] * TIMES) + x[2] * np.exp(-4.0 * x[3] * TIMES),
        (1.0, 1.0, 0.5, 1.2),
    ),
    "sine": (lambda x: x[0] * np.sin(2.0 * np.pi * (1.0 + 0.2 * x[1]) * TIMES), (1.0, 0.5)),
    "saturation": (lambda x: x[0] * TIMES / (0.3 + np.abs(x[1]) + TIMES), (1.0, 0.4)),
    "nearly parallel": (lambda x: x[0] * TIMES + x[1] * (TIMES + 1e-3 * TIMES**2), (1.0, 0.5)),
}
ENOUGH = 1e-4
"""Reduction per sample below which a descent ends."""
SEEDS = range(40)


@pytest.mark.parametrize("damping", [FIRST_DAMPING, WORST_DAMPING])
@pytest.mark.parametrize("name", MODELS)
def test_no_restart_gains_from_where_a_descent_ended(name: str, damping: float) -> None:
    """With bounds and priors or without, whatever damping it began with."""
    model, true = MODELS[name]
    for seed in SEEDS:
        rng, P = np.random.default_rng(seed), len(true)
        noise, spread = 10.0 ** rng.uniform(-3.0, -0.5), rng.choice([0.05, 0.3])
        y = model(true) + noise * rng.standard_normal((len(TIMES), 1))
        below, above = rng.uniform(-0.05, 0.6, (2, P)) if seed % 2 else np.full((2, P), 9.0)
        deviations = rng.uniform(0.3, 30.0, P) if seed % 3 else np.full(P, np.inf)
        limits = BoundsAndPrior(true - below, true + above, np.ones(P), np.array(true), deviations)

        def errors(x: np.ndarray) -> list[np.ndarray]:
            return [(y - model(x)) / noise]  # noqa: B023

        def slopes(x: np.ndarray) -> list[np.ndarray]:
            sides = [(errors(x + h)[0] - errors(x - h)[0]) / 2e-6 for h in 1e-6 * np.eye(len(x))]
            return [np.stack(sides, axis=-1)]

        def end(start: np.ndarray, damping: float) -> tuple[Descended, float]:
            found = levenberg_marquardt(errors, slopes, start, limits, most=200, damping=damping)  # noqa: B023
            return found, found.cost + float(limits.prior_cost(found.vector))  # noqa: B023

        found, cost = end(true + spread * rng.standard_normal(P), damping)
        _, restarted = end(found.vector, FIRST_DAMPING)
        assert found.ended
        assert cost - restarted < ENOUGH * len(TIMES), seed


class Level:
    """Errors (2, 1) that turn along a circle of a wide radius: along it the cost is hardly curved,
    and straight lines promise a minimum far nearer than it is."""

    def errors(self, x: np.ndarray) -> list[np.ndarray]:
        return [RADIUS * np.array([[np.sin(x[0] / 2.0)], [np.cos(x[0] / 2.0) / 2.0]])]

    def slopes(self, x: np.ndarray) -> list[np.ndarray]:
        one = RADIUS * np.array([np.cos(x[0] / 2.0) / 2.0, -np.sin(x[0] / 2.0) / 4.0])
        return [np.stack([one, np.zeros(2)], axis=-1)[:, None, :]]


RADIUS = 30.0
FAR = (2.6, 0.0)
"""Beyond where the cost is curved as straight lines say; the minimum is at zero."""


def test_a_minimum_beyond_what_straight_lines_promise_is_reached() -> None:
    level = Level()
    found = levenberg_marquardt(level.errors, level.slopes, np.array(FAR), LIMITS, good_enough=1e-6)
    assert found.ended
    assert found.vector[0] == pytest.approx(0.0, abs=1e-3)


def test_at_a_minimum_that_no_step_improves_a_descent_ends_after_one_try() -> None:
    """Beyond it a simulation's own error decides which of two points is lower."""
    bottom = descended(Curve()).vector
    curve = Curve(rough=1e-4)
    found = levenberg_marquardt(curve.errors, curve.slopes, bottom, LIMITS, share=1e-4)
    assert found.iterations == 1
    assert curve.asked["errors"] <= 2


def test_the_fall_that_is_promised_is_what_straight_lines_give() -> None:
    rng = np.random.default_rng(4)
    S, r = rng.standard_normal((SAMPLES, 1, 2)), rng.standard_normal((SAMPLES, 1))
    found = Descended(np.zeros(2), float(np.sum(r**2)), 1, (r,), (S,))
    flat = S.reshape(-1, 2)
    left = r.ravel() - flat @ np.linalg.lstsq(flat, r.ravel(), rcond=None)[0]
    expected = float(np.sum(r**2) - np.sum(left**2))
    assert predicted_reduction(found, LIMITS) == pytest.approx(expected, rel=1e-3)


def test_a_descent_in_two_parts_ends_where_it_would_in_one() -> None:
    whole = descended(Curve())
    curve = Curve()
    first = levenberg_marquardt(
        curve.errors, curve.slopes, np.zeros(2), LIMITS, most=2, good_enough=1e-9
    )
    assert not first.ended and whole.ended
    rest = levenberg_marquardt(
        curve.errors, curve.slopes, first.vector, LIMITS, good_enough=1e-9, damping=first.damping
    )
    assert np.array_equal(rest.vector, whole.vector)
    assert first.iterations + rest.iterations == whole.iterations


def test_where_rough_slopes_lead_uphill_exact_ones_are_taken() -> None:
    """Half the steps point the wrong way where a vibration is fast for them."""
    curve, at = Curve(), np.zeros(2)
    uphill = lambda x: [-S for S in curve.slopes(x)]  # noqa: E731
    stuck = levenberg_marquardt(curve.errors, uphill, at, LIMITS, good_enough=1e-9)
    assert stuck.vector == pytest.approx(at)
    found = levenberg_marquardt(
        curve.errors, uphill, at, LIMITS, good_enough=1e-9, exact=curve.slopes
    )
    assert found.vector == pytest.approx(descended(Curve()).vector, abs=1e-6)
