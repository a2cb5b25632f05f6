"""The affine terms add up to the linear model at every posture."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from flexgui.core.simulate.descriptor import descriptor
from flexgui.core.simulate.posture import posture
from tests.helpers import ARMS, loaded, looped

SAME = 1e-10
"""Relative to the largest entry: two orders of evaluation."""

NAMES = ["one mode", "1-1", "2-2", "slide", "ground", "0-2-1"]


def summed(terms: np.ndarray, basis: tuple[str, ...], joints: np.ndarray) -> np.ndarray:
    places = {f"theta{k + 1}": x for k, x in enumerate(joints)}
    factors = [float(sp.sympify(text).subs(places)) for text in basis]
    return np.asarray(np.tensordot(factors, terms, axes=1))


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (1.5, -9.81)], ids=["level", "upright"])
@pytest.mark.parametrize("name", NAMES)
def test_the_terms_add_up_to_the_posture(name: str, gravity: tuple[float, float]) -> None:
    model = looped(loaded(ARMS[name], gravity), 20.0)
    found = descriptor(model, model.numbers())
    joints = 0.4 + 0.7 * np.arange(model.arm.joints)
    here = posture(model, joints)
    for terms, basis, exact in (
        (found.E_terms, found.basis, here.E), (found.A_terms, found.A_basis, here.A),
    ):  # fmt: skip
        assert np.abs(summed(terms, basis, joints) - exact).max() <= SAME * np.abs(exact).max()
    assert np.array_equal(found.B, here.B)


def test_of_the_papers_kind_of_arm_only_cos_theta2_enters() -> None:
    model = looped(ARMS["2-2"])
    found = descriptor(model, model.numbers())
    assert (found.basis, found.A_basis) == (("1", "cos(theta2)"), ("1",))
