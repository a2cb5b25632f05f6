"""Which of the refitted effects comes first."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from core.diagnose.evidence import Weighed, ranked
from core.effects import effect

LARGE, SMALLER = 5000.0, 4000.0
"""Of evidence: far more than a tie apart."""


def weighed(kind: str, fall: float, bic: float, parameters: int, p_value: float = 0.0) -> Weighed:
    return Weighed(
        screened=cast(Any, SimpleNamespace(effect=effect(kind))),
        refit=cast(Any, None),
        parameters=parameters,
        fall=fall,
        explained=30.0 * fall,
        white_drop=bic,
        delta_bic=bic,
        p_value=p_value,
    )


def order(*found: Weighed) -> list[str]:
    return [w.screened.effect.kind for w in ranked(list(found))]


def test_the_sharper_evidence_decides_between_effects_that_leave_nearly_the_same_error() -> None:
    payload = weighed("tip_payload", 0.76, SMALLER, 1)
    ripple = weighed("torque_ripple", 0.76, LARGE, 2)
    assert order(payload, ripple) == ["torque_ripple", "tip_payload"]


def test_a_part_that_does_as_well_by_merit_comes_before_the_whole() -> None:
    coulomb = weighed("coulomb_friction", 0.758, SMALLER, 2)
    presliding = weighed("presliding_friction", 0.762, LARGE, 4)
    assert order(coulomb, presliding) == ["coulomb_friction", "presliding_friction"]


def test_the_whole_comes_first_where_its_part_leaves_much_more() -> None:
    coulomb = weighed("coulomb_friction", 0.50, SMALLER, 2)
    presliding = weighed("presliding_friction", 0.67, LARGE, 4)
    assert order(coulomb, presliding) == ["presliding_friction", "coulomb_friction"]


def test_a_part_that_noise_might_be_does_not_come_before_the_whole() -> None:
    coulomb = weighed("coulomb_friction", 0.758, SMALLER, 2, p_value=0.5)
    presliding = weighed("presliding_friction", 0.762, LARGE, 4)
    assert order(coulomb, presliding) == ["presliding_friction", "coulomb_friction"]
