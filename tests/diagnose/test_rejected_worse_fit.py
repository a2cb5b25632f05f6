"""A model that finer steps take out of the minimum that was found for it is not accepted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from flexgui.core.diagnose import acceptance, search_round
from flexgui.core.diagnose.fit_problem import FitProblem, ParametrisedModel
from flexgui.core.diagnose.refit import Refit
from flexgui.core.effects import effect
from flexgui.core.results import Reason
from tests.diagnose.test_stated_effects import bare

converged = acceptance.converge


def leaving(times: float) -> Callable[..., tuple[FitProblem, Refit]]:
    """As `converged`, with so many times the squared error of the model without the effect."""

    def found(data: FitProblem, h: ParametrisedModel, *rest: Any) -> tuple[FitProblem, Refit]:
        data, refit = converged(data, h, *rest)
        cost = times * bare().base.cost
        return data, replace(refit, descended=replace(refit.descended, cost=cost))

    return found


@pytest.mark.parametrize("times, accepted", [(0.5, True), (1.5, False)])
def test_a_larger_model_that_leaves_more_is_refused_with_a_reason(
    times: float, accepted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(acceptance, "converge", leaving(times))
    begun = bare()
    candidates = [effect("viscous_friction")]
    found = search_round.search_round(begun.data, begun.base, (), candidates, lambda _: False)
    assert (found.accepted is not None) == accepted
    told = [refusal.objection.reason for refusal in found.refusals]
    assert told == ([] if accepted else [Reason.UNSETTLED])
    assert (found.after.cost == begun.base.cost) != accepted
