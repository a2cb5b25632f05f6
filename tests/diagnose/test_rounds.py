"""The order in which a screen tries its sizes, and what it says on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.diagnose import search_round
from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.linear_screen import Screen, screen, trial_rounds
from flexgui.core.diagnose.output_changes import Trial
from flexgui.core.diagnose.progress_messages import (
    RoundProgress,
    fit_title,
    round_title,
    split_note,
)
from flexgui.core.diagnose.search_round import finish_refit
from flexgui.core.effects import catalogue, effect
from flexgui.core.estimate.fit_result import FitResult
from flexgui.core.progress import Silent
from tests.diagnose import fits
from tests.diagnose.test_run import scenario
from tests.helpers import PAPER

KINDS = sorted(catalogue())[:6]
CHOSEN = ("viscous_friction", "torque_ripple", "camera_delay", "stribeck_friction")
"""They change no arm, so that none is compiled late."""


def tried(kind: str, parameter: str) -> Trial:
    return Trial(effect(kind), parameter, {}, {}, False, True, ())


@st.composite
def plans(draw: st.DrawFn) -> list[Trial]:
    """Sizes as `trials` lists them: effect by effect, shape by shape, knob by knob."""
    plan = []
    for kind in draw(st.lists(st.sampled_from(KINDS), unique=True)):
        parameters = draw(st.integers(1, 3))
        for _ in range(draw(st.integers(1, 4))):
            plan += [tried(kind, f"k{k}") for k in range(parameters)]
    return plan


@given(plans())
def test_every_size_is_tried_once_and_every_knob_in_the_first_round(plan: list[Trial]) -> None:
    rounds = trial_rounds(plan)
    assert sorted(i for which in rounds for i in which) == list(range(len(plan)))
    if rounds:
        assert [(plan[i].effect.kind, plan[i].parameter) for i in rounds[0]] == list(
            dict.fromkeys((t.effect.kind, t.parameter) for t in plan)
        )
    assert len(rounds) <= 2


@given(plans(), st.sets(st.integers(0, 20)))
def test_what_is_late_comes_in_no_first_round_but_where_there_is_nothing_else(
    plan: list[Trial], late: set[int]
) -> None:
    rounds = trial_rounds(plan, late)
    assert sorted(i for which in rounds for i in which) == list(range(len(plan)))
    early = set(range(len(plan))) - late
    if early:
        assert not late & set(rounds[0])
        assert {plan[i].parameter for i in rounds[0]} == {plan[i].parameter for i in early}


@cache
def begun() -> BaseFit:
    return fits.begun(scenario())


def followed(stop_after: int | None = None) -> tuple[Screen, list[Screen], list[str]]:
    """The screen of CHOSEN, its sketches and the titles it told."""
    told: list[str] = []
    calls: list[str] = []
    sketches: list[Screen] = []

    def hear(title: str) -> bool:
        calls.append(title)
        told.extend([title] if title else [])
        return len(calls) == stop_after

    start = begun()
    effects = [effect(kind) for kind in CHOSEN]
    found = screen(start.data, start.base.problem, (), effects, hear, sketches.append)
    return found, sketches, told


def kinds(seen: Screen) -> set[str]:
    return {s.effect.kind for s in seen.candidates}


def test_the_first_ranking_knows_every_candidate_and_says_what_it_lacks() -> None:
    found, sketches, told = followed()
    assert sorted(told) == sorted(effect(kind).title for kind in CHOSEN)
    assert len(sketches) == 1
    assert all(kinds(s) == kinds(found) == set(CHOSEN) for s in sketches)
    left = [s.remaining_trials for s in (*sketches, found)]
    assert left == sorted(left, reverse=True) and left[-2] > left[-1] == 0
    assert all(
        len(s.output_changes) + s.remaining_trials == len(found.output_changes) for s in sketches
    )


def figures(seen: Screen) -> Sequence[object]:
    scores = [(s.effect.kind, s.score, s.cost_reduction, dict(s.values)) for s in seen.candidates]
    return (*scores, [(c.parameter, float(np.sum(c.blocks[0]))) for c in seen.output_changes])


def test_who_follows_changes_no_figure() -> None:
    found, _, _ = followed()
    start, effects = begun(), [effect(kind) for kind in CHOSEN]
    assert figures(screen(start.data, start.base.problem, (), effects)) == figures(found)


def test_a_screen_stops_after_any_size_and_ranks_what_it_has() -> None:
    for after in (1, 7):
        found, _, _ = followed(after)
        assert len(found.output_changes) == after and found.remaining_trials > 0
        assert kinds(found) == {c.effect.kind for c in found.output_changes}


def test_an_effect_whose_refit_diverges_is_named_although_another_one_is_added(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It was dropped without a word, as if it explained nothing."""
    lost = effect("viscous_friction")

    def diverging(*arguments: Any) -> FitResult:
        found = finish_refit(*arguments)
        if lost not in found.problem.model.effects:
            return found
        return replace(found, descended=replace(found.descended, cost=np.inf))

    monkeypatch.setattr(search_round, "finish_refit", diverging)
    data, base = begun().data, begun().base
    candidates = [effect("coulomb_friction"), lost]
    found = search_round.search_round(data, base, [], candidates, lambda _: False)
    assert [w.screened.effect.kind for w in found.refitted] == ["coulomb_friction"]
    assert found.accepted is not None and found.failed_refits == (lost.title,)


class Heard(Silent):
    """What was told, in order."""

    def __init__(self) -> None:
        self.titles: list[str] = []
        self.texts: list[str] = []
        self.done = 0

    def stage(self, title: str, total: int | None = None) -> None:
        self.titles.append(title)

    def advance(self, n: int = 1, text: str = "") -> None:
        self.done += n
        self.texts.append(text)


def planned(*kinds: str, **values: float) -> list[Trial]:
    return [Trial(effect(kind), "", values, {}, False, False, ()) for kind in kinds]


@pytest.fixture
def nothing_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FLEXGUI_CACHE", str(tmp_path))


def test_titles_name_two_effects_at_most_and_nothing_that_another_brings_along() -> None:
    friction, *more = (effect(k) for k in ("coulomb_friction", "backlash", "torque_ripple"))
    assert round_title(()) == "Trying every known effect"
    assert round_title((), chosen=True) == "Trying the chosen effects"
    assert round_title([friction]) == "Continuing the search with Coulomb friction in the model"
    assert round_title([friction, *more]) == "Continuing the search with 3 effects in the model"
    assert fit_title(()) == "Fitting the model as it is"
    soft = [effect(kind) for kind in ("rotor_inertia", "joint_elasticity")]
    assert (
        fit_title([*soft, friction]) == "Fitting the model with Elastic joint and Coulomb friction"
    )


@pytest.mark.usefixtures("nothing_compiled")
def test_only_effects_that_change_the_arm_are_said_to_be_compiled() -> None:
    heard = Heard()
    tried = planned("coulomb_friction", "extra_bending_mode", "base_compliance")
    RoundProgress(heard, PAPER, tried).begin("Trying", 3)
    (text,) = heard.texts
    assert text.startswith("(to be compiled once")
    assert "Extra bending mode and Soft base" in text
    assert "Coulomb" not in text
    assert heard.titles == ["Trying"]
    assert heard.done == 0


@pytest.mark.usefixtures("nothing_compiled")
def test_the_note_goes_once_it_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    heard, compiled = Heard(), False
    monkeypatch.setattr("flexgui.core.diagnose.progress_messages.is_compiled", lambda _: compiled)
    told = RoundProgress(heard, PAPER, planned("base_compliance"))
    told("Slow sensor")
    compiled = True
    told("")
    assert split_note(heard.texts[0])[1] != ""
    assert heard.texts[1] == "Slow sensor"
    assert heard.done == 1


def test_no_title_of_an_effect_can_be_mistaken_for_an_aside() -> None:
    assert all(split_note(one.title) == (one.title, "") for one in catalogue().values())
