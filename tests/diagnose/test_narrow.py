"""Sizes that are tried together are judged as each alone, and the best of them is taken."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from core.diagnose.data import hypothesis
from core.diagnose.narrow import TOGETHER, batched, costs, narrowed
from core.effects import effect
from core.effects.effect import Effect
from core.identify.least_squares import cost_of
from tests.diagnose.test_rounds import begun

SAME = 1e-6
"""Relative, of a cost: sums in lanes are taken in another order."""

SIZES = {"joint_elasticity": "c1", "backlash": "bl1", "torque_ripple": "nr1"}
"""Effect -> a parameter of it; the last is no size but a shape."""


def tried(one: Effect, name: str) -> list[dict[str, float]]:
    """The values of an effect at twice and half of where it begins, and more."""
    start = begun().base.hypothesis.model.with_effects([one]).effect_values
    assert name in start, sorted(start)
    return [{**start, name: factor * (start[name] or 1e-3)} for factor in (0.5, 1.0, 1.7, 2.5)]


def alone(one: Effect, values: Mapping[str, float]) -> float:
    h = hypothesis(begun().data, [one], values).coarse
    return cost_of(h.errors(h.vector))


@pytest.mark.parametrize("kind", SIZES)
def test_what_is_tried_togethercosts_what_itcosts_alone(kind: str) -> None:
    one, all_of_them = effect(kind), tried(effect(kind), SIZES[kind])
    found = costs(begun().data, [one], all_of_them)
    np.testing.assert_allclose(found, [alone(one, v) for v in all_of_them], rtol=SAME)


def test_a_size_is_moved_to_where_itcosts_less_and_never_to_where_itcosts_more() -> None:
    one = effect("joint_elasticity")
    for values in tried(one, "c1"):
        found = narrowed(begun().data, begun().base.hypothesis, [one], values, ["c1"])
        assert alone(one, found) <= alone(one, values) * (1.0 + SAME)
        assert {k: v for k, v in found.items() if k != "c1"} == {
            k: v for k, v in values.items() if k != "c1"
        }


def test_who_stops_keeps_the_size_that_was_given() -> None:
    one = effect("joint_elasticity")
    values = tried(one, "c1")[0]
    assert (
        narrowed(begun().data, begun().base.hypothesis, [one], values, ["c1"], lambda: True)
        == values
    )


def test_each_size_is_in_one_batch() -> None:
    sizes = [float(k) for k in range(2 * TOGETHER + 3)]
    parts = list(batched(sizes, TOGETHER))
    assert [x for part in parts for x in part] == sizes
    assert [len(part) for part in parts] == [TOGETHER, TOGETHER, 3]
