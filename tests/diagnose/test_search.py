"""What a search leaves where only a better minimum of the model as given was missing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from core.diagnose.acceptance import Refusal
from core.diagnose.final_ladder import final_ladder
from core.diagnose.implausible import keep_implausible, stands_in, take_out_refuted
from core.diagnose.refit import Refit
from core.diagnose.search import offered
from core.diagnose.state import Options, State, begun_state
from core.effects import effect
from core.progress import Silent
from core.results import DiagnosisRound, Objection, Reason
from tests.diagnose.test_stated import bare, begun

WORSE = 2.0
"""Times the squared error of the minimum."""


def stuck() -> Refit:
    best = bare().base
    return replace(best, descended=replace(best.descended, cost=WORSE * best.cost))


def searched(**changes: Any) -> tuple[State, Any]:
    """After a search that came from a worse minimum to the better one by an effect that is gone."""
    begun = replace(bare(), base=stuck())
    setup: Any = SimpleNamespace(model=SimpleNamespace(effects=()))
    state = begun_state(setup, begun)
    state.refit, state.passed = bare().base, ["Soft base"]
    for name, value in changes.items():
        setattr(state, name, value)
    return state, begun


ASKED = Options(candidates=("torque_offset",))


def test_the_better_minimum_is_the_model_as_given_and_the_ranking_is_its_own() -> None:
    state, begun = searched()
    state, found = final_ladder(state, begun, ASKED, Silent())
    assert found.base is bare().base
    assert [s.added for s in state.steps] == [None]
    assert state.steps[0].cost_per_sample < begun.base.cost / begun.data.count
    assert [r.accepted for r in state.rounds] == [None] and not state.passed
    assert {r.effect for r in state.rounds[0].ranking} == {"torque_offset"}


def test_it_stays_where_effects_are_kept_or_none_was_taken_out_or_the_minimum_is_no_better() -> (
    None
):
    kept = searched(present=[effect("viscous_friction")])
    untouched = searched(passed=[])
    no_better = searched(refit=stuck())
    for state, given in (kept, untouched, no_better):
        assert final_ladder(state, given, ASKED, Silent())[1] is given


def climbed(upper: float, given: int) -> State:
    """A search that has found viscous friction of 6 N m s/rad, of which `upper` is plausible."""
    at = begun(fv1={"start": 5.0, "upper": upper}, fv2=3.0)
    setup: Any = SimpleNamespace(model=at.base.hypothesis.model)
    state = begun_state(setup, at)
    state.given = given
    return state


def test_what_later_effects_press_to_its_bound_is_taken_out_and_not_offered_again() -> None:
    state = climbed(5.5, given=0)
    assert take_out_refuted(state, Silent()) and not state.found
    title, why = state.refuted["viscous_friction"]
    assert (title, why.bound, why.unit) == ("Viscous joint friction", 5.5, "N m s/rad")
    assert state.detours == (), "it did not turn out needless"
    asked = Options(candidates=("viscous_friction", "torque_offset"))
    assert [e.kind for e in offered(state, asked)] == ["torque_offset"]


def test_a_plausible_size_stays_and_so_does_what_a_user_stated() -> None:
    for state in (climbed(7.0, given=0), climbed(5.5, given=1)):
        assert not take_out_refuted(state, Silent()) and len(state.present) == 1


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_what_leaves_more_than_a_refused_effect_by_itself_stands_in_for_the_same(share) -> None:
    """All that was found after it is then taken back, with the reason as the last word."""
    state = climbed(7.0, given=0)
    found = list(state.present)
    left = replace(state.refit.descended, cost=share * state.refit.cost)
    after = replace(state.refit, descended=left)
    weighed: Any = SimpleNamespace(screened=SimpleNamespace(effect=effect("presliding_friction")))
    refusals = [Refusal(weighed, Objection(Reason.AT_BOUND), after)]
    seen: Any = SimpleNamespace(refusals=refusals, data=state.data)
    state.present = []
    last = DiagnosisRound((), None, (refusals[0].with_title,))
    keep_implausible(state, seen, last)
    state.present, state.rounds = found, [DiagnosisRound((), "viscous_friction")]
    assert stands_in(state) == (share < 1.0)
    assert state.present == ([] if share < 1.0 else found)
    assert (state.rounds == [last]) == (share < 1.0)
