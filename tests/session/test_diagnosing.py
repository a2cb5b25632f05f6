"""What is missing, added and taken back, without a page."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from flexgui.core.error_maps import error_maps
from flexgui.jobs import JobPool
from flexgui.jobs.job import DONE, FAILED
from flexgui.sentences.verdict import verdict_paragraphs
from flexgui.sentences.written import format_number
from flexgui.server.services import Services
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from flexgui.session.state import Topic
from flexgui.stages.diagnose.effects import own_parameters, own_place, present
from flexgui.stages.diagnose.fitted_models import errors_of, evidence_of
from flexgui.stages.diagnose.model_versions import ModelFindings, combined_diagnosis, ladder_steps
from flexgui.views.comparison import live_comparison
from flexgui.views.headline import current_verdict, final_estimates
from flexgui.views.pooled import channel_errors, with_role
from tests.session.conftest import SOON
from tests.session.helpers import shortened, until

CANDIDATES = ["coulomb_friction", "viscous_friction", "tip_payload"]
EXPECTED = 0.5
"""Relative: what a ranking predicts of the error that a fit leaves, whose noise it cannot know."""

FLOOR = 1.1
"""Times the floor: noise of a thousand samples alone stays below."""

SAME_FIT = 2e-3
"""Relative: the same fit, simulated again."""

Searched = tuple[Session, list[list[str]]]


def with_friction(session: Session) -> Session:
    """Two short recordings with Coulomb friction that the model lacks."""
    session.choose("something hidden")
    kinds = set_value(("diagnose", "candidates"), CANDIDATES)
    assert session.document.change(shortened(0, 1, 3), kinds)
    return session


@pytest.fixture
def friction(session: Session) -> Session:
    return with_friction(session)


def over(session: Session) -> None:
    until(lambda: not session.run.busy and session.diagnosis.pending is None)


@pytest.fixture(scope="module")
def searched(services: Services, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Searched]:
    """The same, once a search has ended, and the rankings that were told meanwhile."""
    made, seen = Session("searched", tmp_path_factory.mktemp("searched"), services), list[Any]()
    with_friction(made)

    def hear(_: Topic) -> None:
        if made.diagnosis.newest:
            seen.append([r.effect for r in made.diagnosis.newest.ranking])

    made.subscribe(hear)
    assert made.diagnosis.search()
    over(made)
    assert made.run.state.phase == DONE, made.message
    yield made, seen
    made.close()


@pytest.fixture
def looked(friction: Session, searched: Searched) -> Session:
    """A session of its own with what was found."""
    found, _ = searched
    friction.document.scenario = found.document.scenario
    friction.identification.outcome = found.identification.outcome
    friction.identification.outcome_of = found.identification.outcome_of
    friction.diagnosis.versions = found.diagnosis.versions
    friction.diagnosis.models.all = found.diagnosis.models.all
    return friction


def test_the_hidden_effect_comes_first_and_streams_with_residuals_in_floors(
    searched: Searched,
) -> None:
    session, seen = searched
    newest = session.diagnosis.newest
    assert newest is not None and newest.diagnosis is not None
    assert newest.diagnosis.verdict == "missing"
    assert newest.ranking[0].effect == "coulomb_friction"
    assert any(CANDIDATES[0] in each for each in seen[:-1]), "a ranking before the last"
    assert session.identification.outcome is not None
    assert session.identification.outcome_of == session.document.scenario
    found = newest.found
    assert isinstance(found, ModelFindings)
    assert [r.shape for r in found.residual] == [p.shape for p in found.ranking[0].predicted]
    one_fit(session)
    mean = np.sqrt(np.mean(np.concatenate([r.ravel() for r in found.residual]) ** 2))
    assert mean == pytest.approx(np.sqrt(found.step.cost_per_sample), rel=1e-3)


def every_model_is_kept(session: Session) -> None:
    """The model as given stands, that with friction was undone: it can be drawn and come back."""
    diagnosis, models = session.diagnosis, session.diagnosis.models
    assert [m.title for m in models.comparable] == ["As given", "Coulomb friction"]
    given, grown = models.comparable
    assert models.present is given and grown.seconds > 0.0
    assert (evidence_of(grown, grown.version).fall or 0.0) > 10.0
    errors = [errors_of(m, given.version) for m in models.comparable]
    assert errors[0].fitted > FLOOR > errors[1].fitted and errors[1].unseen < FLOOR
    models.show_beside(grown.number)
    name = session.comparison.shown[0].recording
    title, drawn = session.comparison.beside(name) or ("", None)
    assert title == "Coulomb friction" and drawn is not None and drawn.recording == name
    figure = live_comparison(session.comparison.shown[0], ["z1"], None, (title, drawn))
    assert sum(trace["name"] == title for trace in figure["data"]) == 2, "signal and residual"
    assert diagnosis.return_to(grown.number)
    assert models.present is grown and models.beside is None
    assert [kind for kind, _ in present(session.document.scenario)] == ["coulomb_friction"]
    assert session.identification.outcome is grown.version.outcome
    assert models.rename("with friction") and models.comparable[1].title == "with friction"
    assert not diagnosis.return_to(99)


def one_fit(session: Session) -> None:
    """Ladder, words, table of parameters and report's headline after a diagnosis."""
    version, whole = session.diagnosis.versions[-1], session.diagnosis.whole
    assert version.found is not None and version.diagnosis is not None and whole is not None
    step, said = version.found.step, version.diagnosis
    assert step.cost_per_sample == said.steps[-1].cost_per_sample
    values = {e.name: e.value for e in step.parameters}
    for told in (said.parameters, final_estimates(whole)):
        assert {e.name: e.value for e in told if e.name in values} == values
    assert (
        f"{format_number(version.error, 2, keep_zeros=True)} times" in verdict_paragraphs(said)[0]
    )
    assert np.isfinite(step.errors[0].validation_rms)


@pytest.mark.long
def test_add_lets_the_error_fall_and_undo_brings_it_back(friction: Session) -> None:
    """The whole way in one test: what is asserted of its end needs all that came before."""
    assert not friction.diagnosis.known_biased
    friction.diagnosis.search()
    over(friction)
    assert friction.diagnosis.known_biased, "once something is missing"
    given, outcome = friction.document.scenario, friction.identification.outcome
    assert friction.diagnosis.expected is None
    assert friction.diagnosis.add("coulomb_friction")
    expected = friction.diagnosis.expected
    over(friction)
    assert expected == (
        "Coulomb friction",
        pytest.approx(friction.diagnosis.versions[1].error, rel=EXPECTED),
    )
    assert friction.diagnosis.expected is None
    assert not friction.diagnosis.known_biased
    assert friction.run.state.phase == DONE, friction.message
    first, second = ladder_steps(friction.diagnosis.versions)
    assert first.cost_per_sample > FLOOR**2 > second.cost_per_sample
    assert second.added == "coulomb_friction"
    assert all(e.validation_rms < FLOOR * e.floor for e in second.errors)
    assert friction.diagnosis.newest is not None and friction.diagnosis.newest.diagnosis is not None
    assert friction.diagnosis.newest.diagnosis.verdict == "nothing_missing"
    assert friction.identification.outcome is not outcome
    assert friction.identification.outcome_of == friction.document.scenario
    told = combined_diagnosis(friction.diagnosis.versions)
    assert told is not None and (told.verdict, told.final_verdict) == ("missing", "nothing_missing")
    every_channel_agrees(friction)
    assert [step["added"] for step in reported(friction)["steps"]] == [None, "coulomb_friction"]
    assert friction.diagnosis.undo()
    assert friction.comparison.shown is friction.diagnosis.versions[0].comparisons
    assert friction.document.scenario == given and friction.identification.outcome is outcome
    assert len(friction.diagnosis.versions) == 1 and not present(friction.document.scenario)
    every_model_is_kept(friction)


def every_channel_agrees(session: Session) -> None:
    """Map, ladder and Compare."""
    for shown in (session.diagnosis.versions[1].comparisons, session.comparison.shown):
        last = ladder_steps(session.diagnosis.versions)[-1]
        for role, name in (("estimate", "rms"), ("validate", "validation_rms")):
            seen = {e.channel: e.rms for e in channel_errors(with_role(shown, role))}
            told = {e.channel: getattr(e, name) for e in last.errors}
            assert {c: seen[c] for c in told} == pytest.approx(told, rel=SAME_FIT)
    maps = error_maps(session.comparison.shown, session.comparison.floors)
    assert {m.channel for m in maps.by_time} == {e.channel for e in last.errors}
    assert session.comparison.floors == {e.channel: e.floor for e in last.errors}


def reported(session: Session) -> dict[str, Any]:
    """What the page's own report holds."""
    done: list[Path] = []
    assert session.export.report(done.append)
    until(lambda: bool(done))
    return dict(json.loads((done[0] / "result.json").read_text()))


@pytest.mark.long
def test_what_is_said_after_an_add_that_ended_the_ranking_is_of_the_model_as_it_stands(
    friction: Session,
) -> None:
    friction.diagnosis.search()
    until(lambda: friction.diagnosis.newest is not None and bool(friction.diagnosis.newest.ranking))
    assert friction.diagnosis.add("coulomb_friction")
    until(lambda: len(friction.diagnosis.versions) == 2 and not friction.run.busy)
    assert [version.added for version in friction.diagnosis.versions] == [None, "coulomb_friction"]
    assert friction.diagnosis.versions[1].error < FLOOR < friction.diagnosis.versions[0].error
    told = combined_diagnosis(friction.diagnosis.versions)
    assert told is not None and told.standing_verdict == "nothing_missing"
    said = current_verdict(told)
    assert said.startswith("With Coulomb friction nothing more is missing")
    assert (
        f"{format_number(friction.diagnosis.versions[1].error, 2, keep_zeros=True)} times" in said
    )
    assert not any("not found yet" in words for words in verdict_paragraphs(told))
    assert not told.stopped, "of a search that was stopped before"


@pytest.mark.long
def test_a_formula_is_fitted_and_a_hostile_one_refused(looked: Session) -> None:
    given = looked.document.scenario
    for formula in ("__import__('os').system('true')", "a*theta1.real", "a**", "a*nobody"):
        assert not looked.diagnosis.add_own("joint1", formula, "a = 1")
        assert looked.message.bad and "formula" in looked.message.text
        assert looked.document.scenario == given
    assert not looked.diagnosis.add_own("joint1", "-a*dtheta1", "a is one")
    assert "name = start" in looked.message.text
    assert looked.diagnosis.add_own("joint1", "-a*tanh(dtheta1/0.001)", "a = 0.5 [N m]")
    over(looked)
    assert looked.run.state.phase == DONE, looked.message
    first, second = ladder_steps(looked.diagnosis.versions)
    assert second.cost_per_sample < first.cost_per_sample
    a = next(e for e in second.parameters if e.name == "a")
    assert a.unit == "N m" and a.value == pytest.approx(1.2, rel=0.2)
    ranking = looked.diagnosis.versions[0].ranking
    mine = next(r for r in ranking if r.effect == "own_1")
    assert ranking[0].effect == "coulomb_friction", "both joints rub; the formula knows one"
    assert 10.0 < (mine.refit_drop_percent or 0.0) < (ranking[0].refit_drop_percent or 0.0)
    assert [e.name for e in mine.parameters] == ["a"] and mine.predicted
    assert own_place(*looked.diagnosis.versions).startswith("Your formula is number ")
    assert reported(looked)["ranking"]
    assert looked.diagnosis.remove("own_1")
    assert looked.document.scenario == given
    assert looked.diagnosis.add("own_1"), "from the list"
    over(looked)
    assert [kind for kind, _ in present(looked.document.scenario)] == ["own_1"]


def test_a_stop_and_a_failure_leave_the_last_result(looked: Session) -> None:
    complete, given = looked.diagnosis.versions, looked.document.scenario
    assert looked.diagnosis.search()
    looked.run.stop()
    over(looked)
    assert looked.diagnosis.versions == complete and looked.document.scenario == given
    assert "Stopped" in looked.message.text
    assert looked.diagnosis.search()
    over(looked)
    assert not looked.message.text, "of the stop before a search that was complete"
    looked.document.change(set_value(("identify", "parameters"), ["nobody"]))
    assert looked.diagnosis.search()
    over(looked)
    assert looked.run.state.phase == FAILED and looked.message.bad
    assert [v.scenario for v in looked.diagnosis.versions] == [v.scenario for v in complete]


def test_parameters_are_read_with_their_units() -> None:
    assert own_parameters("b = 0.5 [N m], c=2") == {
        "b": {"start": 0.5, "unit": "N m"},
        "c": {"start": 2.0, "unit": ""},
    }
    assert own_parameters(" ") == {}


class SlowPool:
    """Takes a job only after somebody else has had the time to ask for one as well."""

    def __init__(self) -> None:
        self.asked, self.go_on = threading.Event(), threading.Event()

    def submit(self, *_: Any) -> Any:
        self.asked.set()
        self.go_on.wait(SOON)
        return SimpleNamespace(over=False, stop=lambda: None)


def test_two_who_ask_at_the_same_moment_do_not_take_each_others_look_away(
    session: Session, services: Services
) -> None:
    pool = SlowPool()
    session.services = replace(services, pool=cast(JobPool, pool))
    answers: dict[str, bool] = {}

    def ask(who: str) -> threading.Thread:
        def run() -> None:
            answers[who] = session.diagnosis.search()

        thread = threading.Thread(target=run)
        thread.start()
        return thread

    first = ask("first")
    assert pool.asked.wait(SOON)
    second = ask("second")
    second.join(0.3)  # as it was, it is done by now
    pool.go_on.set()
    for thread in (first, second):
        thread.join(SOON)
    assert answers == {"first": True, "second": False}
    assert session.diagnosis.pending is not None


@pytest.mark.long
def test_an_effect_in_the_middle_can_go(friction: Session) -> None:
    for kind in ("viscous_friction", "coulomb_friction"):
        friction.diagnosis.add(kind)
        over(friction)
    assert friction.diagnosis.remove("viscous_friction")
    over(friction)
    assert [kind for kind, _ in present(friction.document.scenario)] == ["coulomb_friction"]
    assert friction.diagnosis.versions[-1].title == "without: Viscous joint friction"
