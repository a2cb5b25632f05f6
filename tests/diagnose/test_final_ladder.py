"""The ladder of what is in the model at the end is in the order of what each effect explains."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from flexgui.core.diagnose.cost_minimum import converge
from flexgui.core.diagnose.evidence import TIE
from flexgui.core.diagnose.final_ladder import RebuiltLadderStep, ladder_to_final_model
from flexgui.core.diagnose.fit_problem import Data, hypothesis
from flexgui.core.diagnose.linear_screen import Screen, screen
from flexgui.core.diagnose.refit import Refit
from flexgui.core.diagnose.whitening import fit_whitener, whitened_rows
from flexgui.core.effects import effect
from flexgui.core.results import DiagnosisRound
from tests.diagnose.test_stated_effects import TRUE, bare, begun

NEVER = lambda: False  # noqa: E731
PAYLOAD = 0.02
"""kg at the tip: far above the noise, and little beside the friction."""
SMALL, LARGE = effect("tip_payload"), effect("viscous_friction")
"""Of which the recordings hold the second alone."""


@cache
def last() -> tuple[Data, Refit, Screen]:
    values = {**bare().base.hypothesis.values(), "fv1": TRUE, "fv2": TRUE / 2, "mt2": 1e-3}
    start = hypothesis(bare().data, [SMALL, LARGE], values)
    data, refit = converge(bare().data, start, None, NEVER)
    seen = screen(bare().data, bare().base.hypothesis, [], [SMALL, LARGE, effect("torque_offset")])
    return data, refit, seen


def climbed(found=(SMALL, LARGE), stopped=NEVER) -> list[RebuiltLadderStep]:  # type: ignore[no-untyped-def]
    data, refit, seen = last()
    return ladder_to_final_model(data, bare().base, refit, [], found, seen, [], stopped)


def test_what_explains_most_comes_first_and_the_last_step_is_the_model_at_the_end() -> None:
    steps = climbed()
    assert [c.effect for c in steps] == [LARGE, SMALL]
    assert [c.round.accepted for c in steps] == ["viscous_friction", "tip_payload"]
    assert steps[0].refit.cost < 0.1 * bare().base.cost  # it is all that is hidden
    assert steps[-1].refit.hypothesis is last()[1].hypothesis


def test_each_effect_is_ranked_against_the_step_before_it() -> None:
    first, second = climbed()
    assert first.round.ranking[0].effect == "viscous_friction"
    assert (first.round.ranking[0].refit_drop_percent or 0.0) > 90.0  # of all that is hidden
    assert second.round.ranking[0].effect == "tip_payload"
    assert (second.round.ranking[0].refit_drop_percent or 0.0) < 50.0  # there is nothing left


def test_later_evidence_does_not_depend_on_all_that_the_model_as_given_lacked() -> None:
    """Beside errors of 29 noise floors an effect that was all but certain seemed to be nothing."""
    start = begun({"tip_payload": {"mt2": PAYLOAD}})
    values = {**start.base.hypothesis.values(), "fv1": TRUE, "fv2": TRUE / 2, "mt2": PAYLOAD}
    data, refit = converge(start.data, hypothesis(start.data, [SMALL, LARGE], values), None, NEVER)
    seen = screen(start.data, start.base.hypothesis, [], [SMALL, LARGE])
    rows = whitened_rows(start.data.experiments)
    loud = fit_whitener([100.0 * x for x in start.base.errors], rows)

    def evidence(seen: Screen) -> list[float | None]:
        steps = ladder_to_final_model(data, start.base, refit, [], [SMALL, LARGE], seen, [], NEVER)
        return [c.round.ranking[0].delta_bic for c in steps]

    (_, quiet), (_, beside) = evidence(seen), evidence(replace(seen, whitener=loud))
    assert quiet is not None and quiet > TIE
    assert quiet == beside


def test_what_else_was_ranked_at_first_stays_beside_it() -> None:
    data, refit, seen = last()
    rival = climbed()[1].round.ranking[0]
    known = [DiagnosisRound((rival,), "tip_payload")]
    steps = ladder_to_final_model(data, bare().base, refit, [], [SMALL, LARGE], seen, known, NEVER)
    assert [r.effect for r in steps[0].round.ranking] == ["viscous_friction", "tip_payload"]


def test_what_was_never_compared_with_the_model_as_given_leaves_the_ladder_as_it_is() -> None:
    assert climbed([LARGE, effect("air_drag")]) == []


def test_when_stopped_the_ladder_stays_as_it_is() -> None:
    assert climbed(stopped=lambda: True) == []
