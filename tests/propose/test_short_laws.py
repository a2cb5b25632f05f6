"""A short law is read off a smooth function's inner products alone, with its constants."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from flexgui.core.effects.own import OwnEffect
from flexgui.core.propose.carriers import SmoothFunction
from flexgui.core.propose.short_laws import Law, ShortLaw, free_names, short_laws
from flexgui.core.propose.variables import Factor, FreeConstant, share_of_bristle
from tests.approved import approved
from tests.helpers import PAPER
from tests.propose.made_up import HIGH, LOW, MadeUp, place
from tests.propose.test_shapes import IN_NUMPY, spline

SEEDS = range(3)
PLACES = np.linspace(LOW, HIGH, 200)

WITHIN = 0.06
"""Relative, of curves: the errors are two to eight times the noise."""

CONSTANTS = 0.1
"""Relative: where a bend lies is seen less well than the curve."""

CHANGE = 1e-9
"""Relative: the same numbers read in two ways."""

UNEVEN = (6.0, -9.0, 14.0, -3.0, -16.0, 2.0, 11.0, -12.0, 5.0)
"""N m, at equal distances: no shape but a table goes through them."""

CASES: dict[str, tuple[Callable[[np.ndarray], np.ndarray], dict[str, float]]] = {
    "proportional": (lambda x: 9.0 * x, {"a": 9.0}),
    "straight line": (lambda x: 10.0 - 4.0 * x, {"a": 10.0, "b": -4.0}),
    "cube": (lambda x: 3.0 * x**3, {"a": 3.0}),
    "beyond a place": (lambda x: 20.0 * np.maximum(x - 0.9, 0.0), {"a": 20.0, "c": 0.9}),
    "outside a dead zone": (
        lambda x: 40.0 * (np.maximum(x - 1.6, 0.0) - np.maximum(0.8 - x, 0.0)),
        {"a": 40.0, "c": 0.8, "d": 1.6},
    ),
    "wave": (
        lambda x: 9.0 * np.sin(7.0 * x) + 5.0 * np.cos(7.0 * x), {"n": 7.0, "a": 9.0, "b": 5.0}
    ),
    "exponential rise": (lambda x: 30.0 * np.exp((x - HIGH) / 0.3), {"a": 30.0, "s": 0.3}),
    "around a place": (
        lambda x: 20.0 * np.exp(-(((x - 1.2) / 0.2) ** 2)), {"a": 20.0, "c": 1.2, "w": 0.2}
    ),
    "table of 9 values": (lambda x: spline(x, LOW, HIGH, *UNEVEN), {}),
}  # fmt: skip


@cache
def function_of(case: str, seed: int = 0) -> SmoothFunction:
    return MadeUp(CASES[case][0], seed=seed).function()


@cache
def laws_of(case: str, seed: int = 0) -> tuple[ShortLaw, ...]:
    return tuple(short_laws(function_of(case, seed)))


def values_of(law: ShortLaw) -> dict[str, float]:
    """Of sizes and constants, as the refit begins with them."""
    return {name: p.value for name, p in zip(law.names, law.parameters, strict=True)}


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("case", CASES)
def test_the_shape_of_an_error_comes_first_with_its_constants(case: str, seed: int) -> None:
    law, (truth, constants) = laws_of(case, seed)[0], CASES[case]
    assert law.shape.title == case
    found = values_of(law)
    assert [found[name] for name in constants] == pytest.approx(
        list(constants.values()), rel=CONSTANTS
    )
    miss = np.linalg.norm(law.values(PLACES) - truth(PLACES))
    assert miss < WITHIN * np.linalg.norm(truth(PLACES))


@pytest.mark.parametrize("case", CASES)
def test_laws_are_ranked_by_what_they_leave_and_the_price_of_their_parameters(case: str) -> None:
    laws = laws_of(case)
    errors = [law.penalised_error for law in laws]
    assert errors == sorted(errors)
    first = laws[0]
    assert first.share > 0.95 * function_of(case).share
    for law in laws:
        if law.share >= first.share:
            assert law.price >= first.price, "what explains more costs more"


def test_each_shape_is_tried_once_with_units_of_its_sizes_and_constants() -> None:
    lines = [
        f"{law.shape.title}: {law.formula(law.names)}, "
        + ", ".join(f"{n} in {p.unit}" for n, p in zip(law.names, law.parameters, strict=True))
        for law in sorted(laws_of("cube"), key=lambda law: law.shape.title)
    ]
    approved("short_laws.txt", "\n".join(lines) + "\n")
    assert free_names(("a", "b", "a"), {"b", "a2"}) == ["a", "b2", "a3"]


def test_a_wave_is_tried_over_angles_alone() -> None:
    of_angle = function_of("cube")
    length = replace(of_angle, variable=replace(of_angle.variable, whole_turns=False))
    assert not any("wave" in law.shape.title for law in short_laws(length))
    assert any("wave" in law.shape.title for law in laws_of("cube"))


@pytest.mark.parametrize("case", ["straight line", "wave", "table of 9 values"])
def test_the_formula_with_its_values_is_the_curve(case: str) -> None:
    for law in laws_of(case):
        text = law.formula(law.names)
        read = eval(text, {**IN_NUMPY, **values_of(law), "theta2": PLACES})
        size = np.abs(law.values(PLACES)).max()
        assert np.broadcast_to(read, PLACES.shape) == pytest.approx(
            law.values(PLACES), abs=CHANGE * size
        )


def braking(made: MadeUp) -> Factor:
    """The direction of motion, against which a positive function acts."""
    along = tuple(np.tanh(np.gradient(x) / 1e-3) for x in made.places)
    text = "friction(theta2)"
    return Factor("Friction", "times the sign of the speed", text, "", along, text, brakes=True)


def test_a_friction_acts_against_the_motion_where_its_formula_is_positive() -> None:
    made = MadeUp(lambda x: -6.0 * x**2)
    function = made.function(factor=braking(made))
    law = next(law for law in short_laws(function) if law.shape.title == "square")
    (a,) = (p.value for p in law.parameters)
    assert a == pytest.approx(6.0, rel=WITHIN)
    for x, f in zip(made.places, function.factor.along, strict=True):
        words = {"a": a, "theta2": x, "friction": lambda _, f=f: f}
        read = eval(law.formula(law.names), {**IN_NUMPY, **words})
        assert read == pytest.approx(law.values(x) * f, abs=1e-6)
    assert law.formula(law.names).startswith("-(")


def test_other_values_give_the_curve_of_those() -> None:
    law = next(law for law in laws_of("wave") if law.shape.title == "wave")
    names, values = law.names, [2.0, -3.0, 4.5]
    other = law.with_values(values)
    read = eval(
        law.formula(names), {**IN_NUMPY, **dict(zip(names, values, strict=True)), "theta2": PLACES}
    )
    assert other.values(PLACES) == pytest.approx(read, abs=1e-9)
    assert [p.value for p in other.parameters] == pytest.approx(values)


@pytest.mark.parametrize("case", CASES)
def test_every_law_is_an_effect_that_begins_within_its_bounds(case: str) -> None:
    """With names that nothing else of the model has."""
    taken = {"a", "c", "a1", "EI1"}
    for law in laws_of(case):
        own = Law((law,)).effect(PAPER, "law_1", taken)
        assert isinstance(own, OwnEffect) and own.target == "joint2"
        assert own.title.startswith("Torque at joint 2 over the position of joint 2, ")
        for quantity in own.own_parameters:
            p = quantity.parameter
            assert p.name not in taken
            assert p.lower <= p.value <= p.upper and p.value != 0.0


WAY = 0.1


def bristle_law(made: MadeUp) -> Sequence[ShortLaw]:
    """Of the share of a bristle, whose way its formula leaves open."""
    along = tuple(share_of_bristle(x, WAY) for x in made.places)
    free = FreeConstant("way", WAY, "rad", WAY / 30.0, WAY * 30.0)
    bristle = replace(
        place(along), word="hysteresis(theta2, {way})", whole_turns=False, constants=(free,)
    )
    return short_laws(made.function(5, variable=bristle))


def test_what_a_variable_leaves_open_is_a_parameter_of_its_laws() -> None:
    laws = bristle_law(MadeUp(lambda x: 0.0 * x))
    assert "constant" not in [law.shape.title for law in laws], "it would not depend on the way"
    for law in laws:
        assert law.names[-1] == "way"
        assert "hysteresis(theta2, s9)" in law.formula([*law.names[:-1], "s9"])
        (way,) = (p for p in law.parameters if p.name == "way")
        assert (way.value, way.unit) == (WAY, "rad") and way.lower < WAY < way.upper


def test_two_terms_are_one_formula_with_names_of_their_own() -> None:
    first = next(law for law in laws_of("wave") if law.shape.title == "straight line")
    second = next(law for law in laws_of("cube") if law.shape.title == "cube")
    both = Law((first, second))
    names = free_names(both.names, ())
    assert names == ["a", "b", "a2"]
    values = [2.0, -3.0, 0.5]
    words = {**dict(zip(names, values, strict=True)), "theta2": PLACES}
    read = eval(both.formula(names), {**IN_NUMPY, **words})
    moved = both.with_values(values)
    assert sum(term.values(PLACES) for term in moved.terms) == pytest.approx(read, abs=1e-9)
    own = both.effect(PAPER, "law_1", set())
    assert [q.parameter.name for q in own.own_parameters] == names
