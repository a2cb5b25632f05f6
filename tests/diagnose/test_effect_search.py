"""What a search leaves where only a better minimum of the model as given was missing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from flexgui.core.diagnose.final_ladder import final_ladder
from flexgui.core.diagnose.refit import Refit
from flexgui.core.diagnose.search_state import Options, State, state_from_base_fit
from flexgui.core.effects import effect
from flexgui.core.progress import Silent
from tests.diagnose.test_stated_effects import bare

WORSE = 2.0
"""Times the squared error of the minimum."""


def stuck() -> Refit:
    best = bare().base
    return replace(best, descended=replace(best.descended, cost=WORSE * best.cost))


def searched(**changes: Any) -> tuple[State, Any]:
    """After a search that came from a worse minimum to the better one by an effect that is gone."""
    begun = replace(bare(), base=stuck())
    setup: Any = SimpleNamespace(model=SimpleNamespace(effects=()))
    state = state_from_base_fit(setup, begun)
    state.refit, state.removed = bare().base, ["Soft base"]
    for name, value in changes.items():
        setattr(state, name, value)
    return state, begun


ASKED = Options(candidates=("torque_offset",))


def test_the_better_minimum_is_the_model_as_given_and_the_ranking_is_its_own() -> None:
    state, begun = searched()
    state, found = final_ladder(state, begun, ASKED, Silent())
    assert found.base is bare().base
    assert [s.added for s in state.ladder] == [None]
    assert state.ladder[0].cost_per_sample < begun.base.cost / begun.data.count
    assert [r.accepted for r in state.rounds] == [None] and not state.removed
    assert {r.effect for r in state.rounds[0].ranking} == {"torque_offset"}


def test_it_stays_where_effects_are_kept_or_none_was_taken_out_or_the_minimum_is_no_better() -> (
    None
):
    kept = searched(present=[effect("viscous_friction")])
    untouched = searched(removed=[])
    no_better = searched(refit=stuck())
    for state, given in (kept, untouched, no_better):
        assert final_ladder(state, given, ASKED, Silent())[1] is given
