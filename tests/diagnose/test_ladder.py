"""The ladder of the last model is in the order of what each effect explains."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from flexgui.core.diagnose.acceptance import Round
from flexgui.core.diagnose.evidence import TIE
from flexgui.core.diagnose.fitted_model import FittedModel, fit_model
from flexgui.core.diagnose.ladder import Ladder, ladder
from flexgui.core.diagnose.linear_screen import screen
from flexgui.core.diagnose.search import Found, Memo, ModelRound, Move
from flexgui.core.effects import effect
from flexgui.core.progress import Silent
from tests.diagnose.test_stated_effects import TRUE, bare, begun

NEVER = lambda: False  # noqa: E731
PAYLOAD = 0.02
"""kg at the tip: far above the noise, and little beside the friction."""
SMALL, LARGE = effect("tip_payload"), effect("viscous_friction")
"""Of which the recordings hold the second alone."""

WORSE = 2.0
"""Times the squared error of the minimum."""


class Stopped(Silent):
    """A person has pressed Stop."""

    def stopped(self) -> bool:
        return True


@cache
def searched(payload: float = 0.0) -> tuple[Found, Memo]:
    """A search that came to both effects at once, in the wrong order."""
    given = begun({"tip_payload": {"mt2": payload}}) if payload else bare()
    base = FittedModel(given.data, given.base, ())
    values = {**given.base.parametrised.values(), "fv1": TRUE, "fv2": TRUE / 2, "mt2": 1e-3}
    last = fit_model(given.data, [SMALL, LARGE], values, NEVER)
    seen = screen(
        given.data, given.base.parametrised, [], [SMALL, LARGE, effect("torque_offset")]
    )  # fmt: skip
    memo = Memo(None, (), given.data.bare.arm.modes)
    first = Round(seen, (), None, base.refit, base.refit, base.data)
    memo.rounds[base.key] = ModelRound(base, first)
    return Found((Move(base), Move(last, "", (SMALL.kind, LARGE.kind))), ()), memo


def climbed() -> Ladder:
    return ladder(*searched(), Silent())


def test_what_explains_most_comes_first_and_the_last_rung_is_the_last_model() -> None:
    found = climbed()
    assert [rung.added for rung in found.rungs] == [None, LARGE, SMALL]
    assert [r.accepted for r in found.rounds] == ["viscous_friction", "tip_payload"]
    assert found.rungs[1].model.refit.cost < 0.1 * bare().base.cost  # it is all that is hidden
    assert found.rungs[-1].model.refit.parametrised is searched()[0].model.refit.parametrised


def test_each_effect_is_ranked_against_the_rung_before_it() -> None:
    first, second = climbed().rounds
    assert first.ranking[0].effect == "viscous_friction"
    assert (first.ranking[0].refit_drop_percent or 0.0) > 90.0  # of all that is hidden
    assert second.ranking[0].effect == "tip_payload"
    assert (second.ranking[0].refit_drop_percent or 0.0) < 50.0  # there is nothing left


def test_what_else_was_tried_at_first_stays_beside_it() -> None:
    assert {r.effect for r in climbed().rounds[0].ranking} == {
        "viscous_friction", "tip_payload", "torque_offset",
    }  # fmt: skip


def test_later_evidence_does_not_depend_on_all_that_the_model_as_given_lacked() -> None:
    """Beside errors of 29 noise floors an effect that was all but certain seemed to be nothing."""
    found = ladder(*searched(PAYLOAD), Silent())
    (evidence,) = (
        r.delta_bic for t in found.rounds for r in t.ranking[:1] if t.accepted == SMALL.kind
    )
    assert evidence is not None and evidence > TIE


def test_a_search_that_is_stopped_has_the_rungs_that_there_are() -> None:
    found, memo = searched()
    assert [rung.added for rung in ladder(found, memo, Stopped()).rungs] == [None]


def test_the_better_minimum_of_the_model_as_given_is_its_own() -> None:
    """A search came from a worse minimum to a better one by an effect that is gone again."""
    data, best = bare().data, bare().base
    stuck = replace(best, descended=replace(best.descended, cost=WORSE * best.cost))
    base, last = FittedModel(data, stuck, ()), FittedModel(data, best, ())
    path = (Move(base), Move(last, "Without: Soft base", removed=("Soft base",)))
    (rung,) = ladder(Found(path, ()), Memo(None, (), data.bare.arm.modes), Silent()).rungs
    assert rung.model is last
