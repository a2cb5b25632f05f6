"""Which of the refitted effects comes first."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from flexgui.core.diagnose.evidence import RefittedCandidate, ranked_candidates
from flexgui.core.effects import effect

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


PRESLIDING = weighed("presliding_friction", 0.762, LARGE, 4)
"""Coulomb friction is a part of it."""


@pytest.mark.parametrize(
    ("first", "second"),
    [
        pytest.param(
            weighed("torque_ripple", 0.76, LARGE, 2), weighed("tip_payload", 0.76, SMALLER, 1),
            id="the sharper evidence where nearly the same error is left",
        ),
        pytest.param(
            weighed("coulomb_friction", 0.758, SMALLER, 2), PRESLIDING,
            id="a part that does as well by merit before the whole",
        ),
        pytest.param(
            weighed("presliding_friction", 0.67, LARGE, 4),
            weighed("coulomb_friction", 0.50, SMALLER, 2),
            id="the whole where its part leaves much more",
        ),
        pytest.param(
            PRESLIDING, weighed("coulomb_friction", 0.758, SMALLER, 2, p_value=0.5),
            id="the whole before a part that noise might be",
        ),
    ],
)  # fmt: skip
def test_what_comes_first(first: RefittedCandidate, second: RefittedCandidate) -> None:
    assert ranked_candidates([second, first]) == [first, second]
