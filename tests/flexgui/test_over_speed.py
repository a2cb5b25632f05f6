"""The law of an effect over a joint's speed, against the effect's own force in a simulation."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.effects import catalogue, effect, with_included
from flexgui.views.over_speed import OverSpeed, over_speed
from tests.effects.helpers import KINDS
from tests.helpers import PAPER, looped

VALUES = {"fc1": 1.2, "fc2": 0.4, "fv1": 3.0, "fv2": 2.0, "fb1": 0.5, "fb2": 0.1}
TIME = np.linspace(0.0, 1.0, 101)
PLACE = np.column_stack([0.1 * np.sin(6 * TIME), 0.2 * np.cos(5 * TIME)])
SPEED = np.gradient(PLACE, TIME, axis=0)


def of(kind: str, **values: float) -> tuple[OverSpeed, ...]:
    base = looped(PAPER)
    model = base.with_effects([effect(kind)], {**VALUES, **values})
    have = with_included([effect(kind)])
    return over_speed(have, model.arm, model.numbers().p, model.effect_values, PLACE, SPEED)


def test_coulomb_friction_is_a_step_against_the_motion() -> None:
    first, second = of("coulomb_friction")
    assert (first.joint, second.joint) == (1, 2) and first.line
    np.testing.assert_allclose(first.torque, -1.2 * np.sign(first.speed))
    np.testing.assert_allclose(second.torque, -0.4 * np.sign(second.speed))
    assert first.speed.min() == SPEED[:, 0].min() and first.speed.max() == SPEED[:, 0].max()


def test_viscous_friction_is_a_slope() -> None:
    first, _ = of("viscous_friction")
    np.testing.assert_allclose(first.torque, -3.0 * first.speed)


def test_an_effect_is_drawn_with_what_it_includes() -> None:
    first, _ = of("stribeck_friction", vs1=0.1, vs2=0.1)
    v = first.speed
    expected = -(1.2 + 0.5 * np.exp(-((v / 0.1) ** 2))) * np.sign(v)
    np.testing.assert_allclose(first.torque, expected)


def test_what_depends_on_the_place_is_drawn_along_the_motion() -> None:
    values = {"ra1": 0.3, "rb1": 0.0, "nr1": 20.0, "ra2": 0.0, "rb2": 0.1, "nr2": 20.0}
    first, _ = of("torque_ripple", **values)
    assert not first.line
    np.testing.assert_allclose(first.speed, SPEED[:, 0])
    np.testing.assert_allclose(first.torque, 0.3 * np.cos(20.0 * PLACE[:, 0]))


@pytest.mark.parametrize("kind", KINDS)
def test_every_effect_has_a_law_for_each_joint_or_none(kind: str) -> None:
    found = of(kind)
    assert len(found) in (0, PAPER.joints)
    assert all(np.isfinite(one.torque).all() for one in found)
    if catalogue()[kind].acts_at in ("tip", "camera", "segments", "base"):
        assert not found, "no law at a joint"
