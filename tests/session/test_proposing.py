"""A law is proposed on demand, put into the model like an effect, and taken back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flexgui.core.results import ProposedLaw
from flexgui.core.results.diagnosis import UNLISTED
from flexgui.jobs.job import DONE
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.model_versions import combined_diagnosis
from tests.sentences.findings import FOUND
from tests.sentences.proposals import law, proposal
from tests.session.helpers import alone, shortened, until
from tests.session.test_candidates import version

SECONDS = 200.0
"""Of a search that a busy machine begins with compiling."""


@pytest.fixture
def unlisted(session: Session) -> Session:
    """Two short recordings with friction, of which nothing in the list may be."""
    session.choose("something hidden")
    assert session.document.change(
        shortened(0, 1, seconds=0.6),
        set_value(("diagnose", "candidates"), ["tip_payload"]),
        set_value(("diagnose", "propose"), False),
    )
    return session


def over(session: Session) -> None:
    until(lambda: not session.run.busy and session.diagnosis.pending is None, SECONDS)
    assert session.run.state.phase == DONE, session.message


def test_a_law_is_found_on_demand_added_and_taken_back(unlisted: Session) -> None:
    diagnosis, given = unlisted.diagnosis, unlisted.document.scenario
    assert diagnosis.search()
    over(unlisted)
    assert diagnosis.newest is not None and diagnosis.newest.diagnosis is not None
    assert diagnosis.newest.diagnosis.verdict == UNLISTED
    assert diagnosis.newest.diagnosis.proposal is None, "the scenario says so"
    assert diagnosis.laws == () and not diagnosis.add_law(0)
    before = [r.effect for r in diagnosis.newest.ranking]
    assert diagnosis.propose()
    over(unlisted)
    assert len(diagnosis.versions) == 1 and unlisted.document.scenario == given
    assert [r.effect for r in diagnosis.newest.ranking] == before, "what was found before stays"
    first = diagnosis.laws[0]
    assert "friction(" in first.formula or "hysteresis(" in first.formula
    assert diagnosis.add_law(0)
    over(unlisted)
    added_as_an_effect(unlisted, first)
    assert diagnosis.undo()
    assert unlisted.document.scenario == given and diagnosis.laws[0] is first


def added_as_an_effect(session: Session, first: ProposedLaw) -> None:
    """It stands in the model, was fitted, and the error fell as it was promised."""
    diagnosis = session.diagnosis
    assert present(session.document.scenario) == (("own_1", first.title),)
    one, other = diagnosis.versions
    assert other.added == "own_1" and other.title == first.title
    assert (one.error, other.error) == pytest.approx(first.rms, rel=0.01)
    assert other.found is not None
    fitted = {e.name: e.value for e in other.found.step.parameters}
    assert {e.name for e in first.parameters} <= set(fitted)
    assert diagnosis.laws == (), "they were of the model before"


def proposing(folder: Path, *laws: ProposedLaw) -> Session:
    """A session whose last search has proposed these laws."""
    session = alone("a-person", folder)
    session.choose("something hidden")
    found = version(6.0, "EI").found
    assert found is not None
    told = replace(found, diagnosis=replace(FOUND, proposal=proposal(*laws)))
    known = replace(version(6.0), scenario=session.document.scenario, found=told)
    session.diagnosis.versions = (known,)
    return session


def test_laws_are_those_of_the_newest_version(tmp_path: Path) -> None:
    session = proposing(tmp_path / "own", law(), law(title="Another law"))
    assert [one.title for one in session.diagnosis.laws] == [law().title, "Another law"]
    session.diagnosis.versions += (version(1.0, added="own_1"),)
    assert session.diagnosis.laws == ()
    session.close()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (law(target="joint9"), "'joint9' is not known"),
        (law(formula="a*max(theta7 - c, 0)"), "'theta7' is not known"),
    ],
)
def test_a_law_that_the_model_cannot_have_is_refused_and_nothing_changes(
    tmp_path: Path, wrong: ProposedLaw, words: str
) -> None:
    session = proposing(tmp_path / "own", wrong)
    given = session.document.scenario
    assert not session.diagnosis.add_law(0)
    assert session.message.bad and words in session.message.text
    assert session.document.scenario == given and len(session.diagnosis.versions) == 1
    session.close()


def test_a_law_that_there_is_none_of_cannot_be_added(tmp_path: Path) -> None:
    session = proposing(tmp_path / "own", law())
    assert not session.diagnosis.add_law(1)
    assert not present(session.document.scenario)
    session.close()


def test_without_a_search_there_is_nothing_to_propose_for(tmp_path: Path) -> None:
    session = alone("a-person", tmp_path / "own")
    assert not session.diagnosis.propose() and not session.run.busy
    session.close()


def test_what_was_proposed_for_a_model_is_not_said_of_the_next(tmp_path: Path) -> None:
    """A law was added, and its search was stopped."""
    session = proposing(tmp_path / "own", law())
    whole = combined_diagnosis(session.diagnosis.versions)
    assert whole is not None and whole.proposal is not None
    after = combined_diagnosis((*session.diagnosis.versions, version(1.0, "a", added="own_1")))
    assert after is not None and after.proposal is None
    session.close()
