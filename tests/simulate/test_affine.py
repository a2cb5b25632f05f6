"""The quick descriptor is the descriptor."""

from __future__ import annotations

import numpy as np
import pytest

from core.simulate.affine import quick_descriptor
from core.simulate.descriptor import descriptor
from core.simulate.posture import posture
from tests.helpers import ARMS, loaded, looped

SAME = 1e-10
"""Relative to the largest entry: two orders of evaluation."""

NAMES = ["one mode", "1-1", "2-2", "slide", "ground", "0-2-1"]


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (1.5, -9.81)], ids=["level", "upright"])
@pytest.mark.parametrize("name", NAMES)
def test_quick_and_derived_descriptor_agree(name: str, gravity: tuple[float, float]) -> None:
    model = looped(loaded(ARMS[name], gravity), 20.0)
    quick, derived = (f(model, model.numbers()) for f in (quick_descriptor, descriptor))
    assert quick.basis == derived.basis
    assert quick.A_basis == derived.A_basis
    assert (quick.states, quick.inputs, quick.outputs) == (
        derived.states,
        derived.inputs,
        derived.outputs,
    )
    for field in ("E_terms", "A_terms", "B", "C", "D"):
        a, b = getattr(quick, field), getattr(derived, field)
        assert np.abs(a - b).max(initial=0.0) <= SAME * np.abs(b).max(initial=0.0), field


def test_the_terms_add_up_to_the_posture() -> None:
    """E0 + cos(theta2) E1 of the paper's kind of arm."""
    model = looped(ARMS["2-2"])
    found = quick_descriptor(model, model.numbers())
    assert found.basis == ("1", "cos(theta2)")
    here = posture(model, np.array([0.4, 1.1]))
    E = found.E_terms[0] + np.cos(1.1) * found.E_terms[1]
    assert np.abs(E - here.E).max() <= SAME * np.abs(here.E).max()
    assert np.abs(found.A_terms[0] - here.A).max() <= SAME * np.abs(here.A).max()
