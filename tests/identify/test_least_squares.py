"""What a descent spends: errors and slopes are counted, for each of them is a simulation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from flexgui.core.least_squares import Descended, Limits, descend, predicted_reduction

LIMITS = Limits(np.full(2, -9.0), np.full(2, 9.0), np.ones(2))
SAMPLES = 500
NEAR = (1.02, 1.96)
"""Some deviations from the minimum."""
NOISE = 0.1
WRONG = 0.55
"""Times the true slopes: a step along them goes nearly twice as far as it should."""
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


def descended(curve: Curve, keep: bool = False, start: tuple[float, float] = (0.0, 0.0)):  # type: ignore[no-untyped-def]
    at = np.array(start)
    return descend(curve.errors, curve.slopes, at, LIMITS, good_enough=1e-9, keep=keep)


def test_slopes_that_are_kept_lead_to_the_same_minimum_for_one_look_at_them() -> None:
    fresh, kept = Curve(), Curve()
    a, b = descended(fresh, start=NEAR), descended(kept, keep=True, start=NEAR)
    deviation = NOISE / np.sqrt(SAMPLES)
    assert b.vector == pytest.approx(a.vector, abs=1e-2 * deviation)
    assert kept.asked["slopes"] == 1 < fresh.asked["slopes"]


def test_slopes_that_no_longer_fit_are_taken_anew() -> None:
    """Along slopes that are too flat a step overshoots and falls by a part of its promise."""
    curve = Curve()

    def late(x: np.ndarray) -> list[np.ndarray]:
        factor = WRONG if not curve.asked["slopes"] else 1.0
        return [factor * s for s in curve.slopes(x)]

    found = descend(curve.errors, late, np.zeros(2), LIMITS, good_enough=1e-9, keep=True)
    assert curve.asked["slopes"] > 1
    assert found.cost == pytest.approx(descended(Curve()).cost, rel=1e-6)


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


@pytest.mark.parametrize("keep", [False, True])
def test_a_minimum_beyond_what_straight_lines_promise_is_reached(keep: bool) -> None:
    """Kept slopes led to where the errors were at right angles to slopes of another place."""
    level = Level()
    found = descend(level.errors, level.slopes, np.array(FAR), LIMITS, good_enough=1e-6, keep=keep)
    assert found.ended
    assert found.vector[0] == pytest.approx(0.0, abs=1e-3)


def test_at_a_minimum_that_no_step_improves_a_descent_ends_after_one_try() -> None:
    """Beyond it a simulation's own error decides which of two points is lower."""
    bottom = descended(Curve()).vector
    curve = Curve(rough=1e-4)
    found = descend(curve.errors, curve.slopes, bottom, LIMITS, good_enough=1e-4, keep=True)
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
    first = descend(curve.errors, curve.slopes, np.zeros(2), LIMITS, most=2, good_enough=1e-9)
    assert not first.ended and whole.ended
    rest = descend(
        curve.errors, curve.slopes, first.vector, LIMITS, good_enough=1e-9, damping=first.damping
    )
    assert np.array_equal(rest.vector, whole.vector)
    assert first.iterations + rest.iterations == whole.iterations


def test_where_rough_slopes_lead_uphill_exact_ones_are_taken() -> None:
    """Half the steps point the wrong way where a vibration is fast for them."""
    curve, at = Curve(), np.zeros(2)
    uphill = lambda x: [-S for S in curve.slopes(x)]  # noqa: E731
    stuck = descend(curve.errors, uphill, at, LIMITS, good_enough=1e-9)
    assert stuck.vector == pytest.approx(at)
    found = descend(curve.errors, uphill, at, LIMITS, good_enough=1e-9, exact=curve.slopes)
    assert found.vector == pytest.approx(descended(Curve()).vector, abs=1e-6)
