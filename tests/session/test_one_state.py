"""Ladder, verdict, colours of the arm and captions are of one result, and it is said whose."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from flexgui.core.results import NOTHING
from flexgui.library.shipped import HIDDEN
from flexgui.page.earlier_work import DIAGNOSIS, FIT, other_settings
from flexgui.sentences.verdict import card_words
from flexgui.server.services import Services
from flexgui.session.scenario_edits import set_arm, set_value
from flexgui.session.session import Session
from flexgui.session.settings import settings_of
from flexgui.stages.diagnose.model_versions import ladder_steps
from flexgui.stages.diagnose.panel_candidates import WORDS
from tests.session.helpers import shortened, until

KINDS = ["coulomb_friction", "tip_payload"]
GIVEN, WITH_FRICTION = 1, 2
"""Numbers of the models."""


def over(session: Session) -> None:
    until(lambda: not session.run.busy and session.diagnosis.pending is None)


@pytest.fixture(scope="module")
def grown(services: Services, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    """A session that has found friction and added it."""
    made = Session("grown", tmp_path_factory.mktemp("grown"), services)
    made.choose(HIDDEN)
    assert made.document.change(shortened(0, 3), set_value(("diagnose", "candidates"), KINDS))
    assert made.diagnosis.search()
    over(made)
    assert made.diagnosis.add("coulomb_friction")
    over(made)
    made.show("Diagnose")
    yield made
    made.close()


@pytest.fixture
def session(grown: Session) -> Session:
    """The same with its own settings and the model with friction."""
    assert grown.diagnosis.return_to(WITH_FRICTION)
    assert present_ones(grown)
    return grown


def bend(session: Session, gigapascal: float) -> None:
    edit = set_arm(session.document.scenario, "young_modulus", 1e9 * gigapascal)
    assert session.document.change(edit)


def present_ones(session: Session) -> bool:
    """Whether what is shown is of the present settings; that all of it is of one result."""
    diagnosis, shown = session.diagnosis, session.comparison.shown
    newest, now = diagnosis.newest, session.document.scenario
    assert newest is not None and newest.found is not None
    assert shown is newest.comparisons and session.identification.outcome_of == newest.scenario
    notes = [other_settings(session, of) for of in (FIT, DIAGNOSIS)]
    assert notes[0].replace("fit", "") == notes[1].replace("diagnosis", "")
    is_present = newest.scenario == now
    assert is_present == (not notes[0])
    assert (session.comparison.on_arm is not None) == is_present, (
        "the arm moves by the present ones"
    )
    of = [settings_of(v.scenario) for v in diagnosis.versions]
    kept = [{k: v for k, v in each.items() if k[0] != "model"} for each in of]
    assert all(each == kept[0] for each in kept), "a ladder has steps of one kind of settings"
    return is_present


def errors(session: Session) -> list[float]:
    """Of the ladder, in noise floors."""
    steps = ladder_steps(session.diagnosis.compared_versions)
    return [round(float(step.cost_per_sample**0.5), 2) for step in steps]


def test_a_changed_setting_makes_results_past_and_the_old_one_shows_them_again(
    session: Session,
) -> None:
    before = errors(session)
    newest = session.diagnosis.newest
    assert newest is not None and newest.diagnosis is not None
    assert card_words(newest.diagnosis)[:2] == (NOTHING, "Nothing is missing.")
    bend(session, 1.1)
    assert not present_ones(session) and errors(session) == before
    said = str(WORDS.past_verdict(newest.diagnosis, newest.error))
    assert "Past verdict, of those settings: Nothing is missing." in said and NOTHING not in said
    assert "1.1\N{NO-BREAK SPACE}GPa" in other_settings(session, DIAGNOSIS)
    bend(session, 1.0)
    assert present_ones(session) and errors(session) == before


def test_a_step_that_is_undone_with_other_settings_is_undone_in_all_that_is_shown(
    session: Session,
) -> None:
    """The ladder went back, and the arm stayed as pale as with the effect."""
    high = errors(session)[0]
    bend(session, 1.1)
    assert session.diagnosis.undo()
    assert not present_ones(session) and errors(session)[-1] == pytest.approx(high, rel=0.1)
    bend(session, 1.0)
    assert present_ones(session) and len(errors(session)) == 1
    assert session.diagnosis.return_to(WITH_FRICTION)
    assert session.diagnosis.undo() and present_ones(session)


def test_a_model_of_other_settings_begins_a_ladder_of_its_own(session: Session) -> None:
    before = errors(session)
    bend(session, 1.2)
    assert session.diagnosis.remove("coulomb_friction")
    over(session)
    assert present_ones(session) and len(errors(session)) == 1
    assert len(session.diagnosis.models.listed) > 2, "the others stay"
    assert session.diagnosis.return_to(WITH_FRICTION)
    assert present_ones(session) and errors(session) == before


def test_a_profile_outlives_a_change_of_the_model_and_back(session: Session) -> None:
    assert session.identification.find_profile("EI", None)
    until(lambda: not session.run.busy and session.identification.profile is not None)
    found = session.identification.profile
    assert session.diagnosis.undo() and session.identification.profile is None
    bend(session, 1.1)
    assert session.diagnosis.return_to(WITH_FRICTION)
    assert session.identification.profile is found
