"""What every joint in the folder must keep; a new file inherits these tests."""

from __future__ import annotations

import pytest
import sympy as sp

from flexgui.core.arm.joints import joint
from flexgui.core.arm.joints.joint import Joint
from flexgui.core.errors import InputError
from flexgui.core.plugins import classes_of

KINDS = sorted(classes_of("flexgui.core.arm.joints", Joint))


@pytest.mark.parametrize("kind", KINDS)
def test_joint_says_what_it_is_and_in_which_units(kind: str) -> None:
    found = joint(kind)
    assert found.kind == kind
    assert type(found).__doc__
    assert found.coordinate_unit and found.effort_unit and found.inertia_unit


@pytest.mark.parametrize("kind", KINDS)
def test_placement_is_linear_in_the_coordinate_and_none_at_zero(kind: str) -> None:
    """The inertia's affine statement rests on this."""
    q, axis = sp.symbols("q axis", real=True)
    put = joint(kind).place(q, axis)
    for part in (put.turn, put.slide):
        assert part.subs(q, 0) == 0
        assert sp.diff(part, q, 2) == 0
    assert not put.direction.has(q)
    assert (put.turn, put.slide) != (0, 0)


def test_an_unknown_joint_is_named_with_the_nearest_known_one() -> None:
    with pytest.raises(InputError, match="did you mean 'revolute'"):
        joint("revolut")
