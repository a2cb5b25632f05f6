"""The arm's parameters by name and the vector that compiled code takes."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.arm import Structure
from flexgui.core.arm.catalogue import ArmCatalogue
from flexgui.core.arm.slots import STIFFNESS, arm_vector, slot
from flexgui.core.arm.symbols import Symbols
from tests.helpers import ARMS, EVERY_ARM, PAPER, loaded

ROUNDING = 1e-14


@pytest.mark.parametrize("name", EVERY_ARM)
def test_every_parameter_at_its_own_value_gives_the_arm(name: str) -> None:
    catalogue = ArmCatalogue(loaded(ARMS[name], (0.3, -9.81)))
    p = arm_vector(catalogue.arm)
    assert len(p) == len(Symbols(Structure.of(catalogue.arm)).p)
    for item in catalogue.parameters.values():
        found = catalogue.vectors([item.name], np.array([[item.value]]))[0]
        assert np.allclose(found, p, rtol=ROUNDING, atol=0.0), item.name
        assert item.lower <= item.value <= item.upper
        assert item.unit and item.title and item.symbol


@pytest.mark.parametrize("name", ["1-1", "slide", "0-2-1"])
def test_every_parameter_moves_the_vector(name: str) -> None:
    catalogue = ArmCatalogue(loaded(ARMS[name]))
    base = arm_vector(catalogue.arm)
    for item in catalogue.parameters.values():
        changed = catalogue.vectors([item.name], np.array([[item.value + 0.1 * item.scale]]))[0]
        assert not np.array_equal(changed, base), item.name


def test_modulus_and_width_enter_only_as_epsilon_d4() -> None:
    catalogue = ArmCatalogue(PAPER)
    valley = np.array([[1e9 * s**-4.0, 0.05 * s] for s in (0.9, 1.0, 1.1)])
    p = catalogue.vectors(["epsilon", "d"], valley)
    assert p[:, slot(0, STIFFNESS)] == pytest.approx(520.8333333, rel=1e-9)
    assert np.allclose(p, p[0], rtol=1e-12)


def test_many_value_vectors_are_as_one_by_one() -> None:
    catalogue = ArmCatalogue(PAPER)
    names = ["EI1", "m2", "tau1", "g2"]
    values = np.random.default_rng(1).uniform(0.5, 2.0, (5, 4))
    together = catalogue.vectors(names, values)
    for row, each in zip(together, values, strict=True):
        assert np.array_equal(catalogue.vectors(names, each[None])[0], row)


def test_shared_parameters_are_offered_only_where_segments_agree() -> None:
    assert {"EI", "epsilon", "d"} <= set(ArmCatalogue(PAPER).parameters)
    assert "EI" not in ArmCatalogue(ARMS["1-1"]).parameters
    assert "epsilon" not in ArmCatalogue(ARMS["1-1"]).parameters
