"""Which of the refitted effects comes first."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from flexgui.core.diagnose import search_round
from flexgui.core.diagnose.evidence import RefittedCandidate, ranked_candidates
from flexgui.core.diagnose.search_round import candidate_with_more_shapes
from flexgui.core.effects import effect

SHAPE = "extra_bending_mode"

LARGE, SMALLER = 5000.0, 4000.0
"""Of evidence: far more than a tie apart."""


def weighed(
    kind: str, reduction: float, bic: float, parameters: int, p_value: float = 0.0
) -> RefittedCandidate:
    return RefittedCandidate(
        screened=cast(Any, SimpleNamespace(effect=effect(kind))),
        refit=cast(Any, None),
        parameters=parameters,
        reduction=reduction,
        explained=30.0 * reduction,
        whitened_reduction=bic,
        delta_bic=bic,
        p_value=p_value,
    )


def order(*found: RefittedCandidate) -> list[str]:
    return [w.screened.effect.kind for w in ranked_candidates(list(found))]


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


@pytest.mark.parametrize(
    "whole", [(), ("joint_elasticity",), (SHAPE,), ("joint_elasticity", SHAPE)]
)
def test_a_finer_model_goes_first_unless_a_physical_effect_explains_everything(
    whole: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    joint, shape = weighed("joint_elasticity", 0.9, LARGE, 4), weighed(SHAPE, 0.8, SMALLER, 0)
    found = [
        replace(w, refit=cast(Any, SimpleNamespace(errors=w.screened.effect.kind in whole)))
        for w in (joint, shape)
    ]
    monkeypatch.setattr(search_round, "within_noise", lambda _, errors: errors)
    first = candidate_with_more_shapes(found, cast(Any, None))
    assert (first is None) is ("joint_elasticity" in whole)
    assert first is None or first.screened.effect.kind == SHAPE


def test_a_finer_model_that_explains_little_does_not_go_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(search_round, "within_noise", lambda _, errors: False)
    little = replace(weighed(SHAPE, 0.1, SMALLER, 0), refit=cast(Any, SimpleNamespace(errors=())))
    assert candidate_with_more_shapes([little], cast(Any, None)) is None
