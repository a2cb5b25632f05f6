"""What is said of what the data fix and leave free."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.identify.identifiability import POORLY_DISTINGUISHABLE
from flexgui.core.results import Identifiability
from flexgui.sentences.identifiability import (
    LARGEST_DENOMINATOR,
    identifiability_sentences,
    product,
)
from tests.approved import approved
from tests.sentences.findings import as_page


def sentences(
    labels: Sequence[str],
    correlation: np.ndarray,
    null: Sequence[Sequence[float]] = (),
    unsure: tuple[int, ...] = (),
) -> tuple[str, ...]:
    directions = np.array(null).reshape(-1, len(labels))
    found = Identifiability(tuple(labels), 0, np.ones(len(labels)), directions, unsure)
    estimates = [SimpleNamespace(lower=0.1)] * len(labels)
    fit: Any = SimpleNamespace(
        identifiability=found, correlation=correlation, contradicted={}, estimates=estimates
    )
    return identifiability_sentences(fit)


def test_what_is_said_of_a_fit_that_leaves_something_free() -> None:
    start = ("a", "start_v1_1@r1", "start_v1_1@r2")
    imitated = np.array([[1.0, 0.999, 0.0], [0.999, 1.0, -0.999], [0.0, -0.999, 1.0]])
    alike = np.array([[1.0, 0.99999, 0.0], [0.99999, 1.0, 0.0], [0.0, 0.0, 1.0]])
    poorly = np.array([[1.0, -0.995, 0.2], [-0.995, 1.0, 0.1], [0.2, 0.1, 1.0]])
    told = {
        "a first state imitates a parameter": sentences(start, imitated),
        "a pair of one law and a wide deviation": sentences("abc", alike, unsure=(2,)),
        "nothing is said about two": sentences("ab", np.eye(2), [[1.0, 0.0], [0.0, 1.0]]),
        "two move together": sentences("abc", poorly),
    }
    approved("identifiability.md", as_page(told))


@given(st.floats(-POORLY_DISTINGUISHABLE, POORLY_DISTINGUISHABLE))
def test_a_moderate_correlation_is_not_mentioned(rho):
    told = sentences("ab", np.array([[1.0, rho], [rho, 1.0]]))
    assert told == ("All estimated parameters are identifiable.",)


POWERS = st.builds(
    Fraction, st.integers(1, 4), st.integers(1, LARGEST_DENOMINATOR)
).filter(lambda f: f >= 1)  # fmt: skip


def raised(name: str, power: str) -> str:
    """x⁴, x⁻¹ or x^(3/2)."""
    if "/" in power:
        return f"{name}^({power})"
    return name + power.translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


@given(POWERS, st.booleans(), st.booleans())
def test_the_exponents_are_those_of_the_direction(power, inverse, swapped):
    """x y^n (or x y^-n) stays where x changes by n and y by -1 (or 1)."""
    direction = np.array([float(power), 1.0 if inverse else -1.0])
    direction /= np.linalg.norm(direction)
    n = f"{'-' if inverse else ''}{power}"
    other = "y" if n == "1" else raised("y", n)
    names = ["x", "y"]
    if swapped and power != 1:
        text = product(direction[::-1], ["y", "x"])
        sign = "-" if inverse else ""
        assert text == f"{raised('y', str(power))} {raised('x', '-1') if sign else 'x'}"
    else:
        assert product(direction, names) == f"x {other}"
