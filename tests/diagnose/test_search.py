"""The walk from model to model ends, whatever its questions answer."""

from __future__ import annotations

from collections import Counter
from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.diagnose import search
from flexgui.core.diagnose.evidence import Round
from flexgui.core.diagnose.linear_screen import screen
from flexgui.core.diagnose.memo import Memo
from flexgui.core.diagnose.noise_update import LEAST_RATIO
from flexgui.core.diagnose.search import MOVES_PER_EFFECT, Move, Search
from flexgui.core.diagnose.search_options import Options
from flexgui.core.effects import effect
from flexgui.core.estimate.fitted_model import FittedModel
from flexgui.core.progress import Silent
from tests.diagnose.test_stated_effects import bare

SAMPLES = 1000
QUESTIONS = 8
"""That the search asks of a model, each at most once."""

EFFECTS = ("backlash", "camera_delay", "tip_payload")


def model(effects: tuple[str, ...], floor: float, cost: float) -> Any:
    return SimpleNamespace(
        effects=effects, key=tuple(sorted(effects)), refit=SimpleNamespace(cost=cost),
        data=SimpleNamespace(floors={"z1": floor}, count=SAMPLES),
    )  # fmt: skip


ANY_MODEL = st.builds(
    model,
    st.lists(st.sampled_from(EFFECTS), unique=True).map(tuple),
    st.integers(0, 3).map(lambda n: LEAST_RATIO**n),
    st.floats(0.5, 100.0).map(lambda x: x * SAMPLES),
)
ANSWERS = st.one_of(
    st.none(),
    st.builds(Move, ANY_MODEL, st.sampled_from(["", "More", "Without"]), to_confirm=st.booleans()),
)


class Scripted(Search):
    """Each question is answered at random."""

    draw: Any
    asked = 0

    def _prepared(self, model: Any) -> Any:
        return model

    def _resolved(self, model: Any) -> Any:
        return model

    def _answer(self, *_: Any) -> Move | None:
        self.asked += 1
        return cast("Move | None", self.draw(ANSWERS))

    _noise_of_better_model = _shapes_of_better_model = _addition = _reduction = _answer
    _exchange = _shapes = _noise = _noise_alone = _answer


@settings(max_examples=300, deadline=None)
@given(st.data(), st.integers(0, 4))
def test_the_search_ends_within_a_stated_number_of_moves_and_visits_nothing_thrice(
    data: st.DataObject, limit: int
) -> None:
    """Floors that alternate, and a set that is refitted for ever, cannot be."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "with_stated_sizes", lambda model, *_: model)
        memo = Memo(None, (), (0,))
        walk = Scripted(Options(max_effects=limit), Silent(), None, memo)
        walk.draw = data.draw
        found = walk.run(model((), 1.0, 100.0 * SAMPLES))
    most = MOVES_PER_EFFECT * (limit + 1)
    assert len(memo.visits) <= most and walk.asked <= QUESTIONS * most
    assert len(found.path) <= most + 1
    visits = Counter((v.key, round(v.floors["z1"], 6)) for v in memo.visits)
    assert max(visits.values()) <= 2


def test_an_estimate_of_the_noise_that_no_effect_confirms_is_taken_back() -> None:
    """With what the limit kept out against that noise alone: a search that adds nothing said
    `missing` of an error at the noise."""

    class Confirming(Scripted):
        def _answer(self, *_: Any) -> Move | None:
            return None

        _noise_of_better_model = _shapes_of_better_model = _reduction = _answer
        _exchange = _shapes = _noise_alone = _answer

        def _addition(self, model: Any) -> Move | None:
            self.proposed = () if model.data.floors["z1"] == 1.0 else ("backlash",)
            return None

        def _noise(self, first: Any, model_: Any) -> Move | None:
            lower = model((), 0.5, 400.0 * SAMPLES)
            return Move(lower, to_confirm=True) if model_.data.floors["z1"] == 1.0 else None

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "with_stated_sizes", lambda model, *_: model)
        walk = Confirming(Options(max_effects=1), Silent(), None, Memo(None, (), (0,)))
        found = walk.run(model((), 1.0, 100.0 * SAMPLES))
    assert found.model.data.floors == {"z1": 1.0} and len(walk.memo.visits) == 2
    assert found.proposed == ()


def test_of_all_models_that_were_screened_the_last_one_alone_keeps_its_columns() -> None:
    """On long recordings the columns of one screen take .4 GB."""
    data, base = bare().data, bare().base
    seen = screen(data, base.problem, [], [effect("viscous_friction")])
    memo = Memo(None, (), data.bare.arm.modes)
    for added in ((), (effect("torque_offset"),)):
        visited = FittedModel(data, base, added)
        memo.keep(visited, Round(seen, (), None, base, base, data))
    first, last = (known.round.screen for known in memo.rounds.values())
    assert last.output_changes and last.slopes
    assert not first.output_changes and not first.slopes
    assert first.candidates == seen.candidates  # what is stated of them stays
