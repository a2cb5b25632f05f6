"""A law is proposed on demand and put into the model; what an effect does to the arm is shown."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.results import LadderStep, MissingTorque, ProposedLaw, RecordingComparison
from flexgui.core.results.diagnosis import UNLISTED
from flexgui.jobs.job import DONE
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.model_versions import ModelFindings, ModelVersion, combined_diagnosis
from flexgui.stages.diagnose.plots import demonstration, demonstration_summary
from flexgui.views.missing_torque import missing_cloud
from tests.sentences.findings import FOUND
from tests.sentences.proposals import law, proposal
from tests.session.helpers import alone, shortened, until
from tests.session.test_shown import version

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


@pytest.mark.long
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
    assert not diagnosis.formulas, "nobody wrote it"


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
    whole = combined_diagnosis(session.diagnosis.versions)
    assert whole is not None and whole.proposal is not None
    assert not session.diagnosis.add_law(2) and not present(session.document.scenario)
    assert [one.title for one in session.diagnosis.laws] == [law().title, "Another law"]
    session.diagnosis.versions += (version(1.0, added="own_1"),)
    assert session.diagnosis.laws == ()
    whole = combined_diagnosis(session.diagnosis.versions)
    assert whole is not None and whole.proposal is None, "it was of the model before"
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


def short(session: Session) -> None:
    session.choose("something hidden")
    assert session.document.change(shortened(0))


def test_an_effect_is_shown_where_it_changes_most(session: Session) -> None:
    short(session)
    assert session.demonstration.start("coulomb_friction")
    until(lambda: session.demonstration.shown is not None or bool(session.demonstration.not_shown))
    shown = session.demonstration.shown
    assert shown is not None, session.demonstration.not_shown
    assert shown.kind == session.demonstration.kind == "coulomb_friction"
    assert {p.name for p in shown.sizes} == {"fc1", "fc2"}
    assert "f<sub>c1</sub>" in demonstration_summary(shown)
    assert np.abs(shown.with_it - shown.without).max() > 0.0
    assert len(shown.time) == len(shown.measured) < 1000
    names = [t["name"] for t in demonstration(shown)["data"]]
    assert names[:3] == ["measured", "without it", "with it"]
    assert not session.run.busy, "the session's own job is another one"
    session.demonstration.end()
    assert session.demonstration.shown is None


def test_every_listed_effect_is_shown_and_another_says_why_not(session: Session) -> None:
    """A diagnosis ranks in all that was measured, not only in the tip that is fitted here."""
    short(session)
    assert session.document.scenario.identify.output == ("z",)
    listed = ("torque_ripple", "sensor_lag", "sensor_gain")
    for kind in (*listed, "nobody"):
        session.demonstration.start(kind)
        until(
            lambda: session.demonstration.shown is not None or bool(session.demonstration.not_shown)
        )
        assert (session.demonstration.shown is not None) == (kind in listed), (
            session.demonstration.not_shown
        )
    assert session.demonstration.not_shown.endswith((".", "?"))


def test_another_model_ends_it(session: Session) -> None:
    short(session)
    session.demonstration.start("viscous_friction")
    until(lambda: session.demonstration.shown is not None)
    session.document.change(lambda document: document["recordings"][0].update(role="validate"))
    assert session.demonstration.shown is None and not session.demonstration.kind


def test_the_missing_torque_is_shown_with_the_law_of_the_effect_in_it(session: Session) -> None:
    short(session)
    assert session.demonstration.start("coulomb_friction")
    until(lambda: session.demonstration.shown is not None)
    shown = session.demonstration.shown
    assert shown is not None and [t.joint for t in shown.torques] == [1, 2]
    assert session.demonstration.torques == (), "no diagnosis has told what is missing"
    torques = tuple(missing(joint) for joint in (1, 2))
    seen = RecordingComparison(shown.recording, "estimate", "", (), torques)
    session.diagnosis.versions = (
        ModelVersion(session.document.scenario, found=LOOKED, comparisons=(seen,)),
    )
    assert session.demonstration.torques == torques
    data = missing_cloud(torques, shown.torques, shown.title)["data"]
    laws = [t for t in data if t["name"] == "Coulomb friction"]
    assert [t["yaxis"] for t in laws] == ["y", "y2"] and laws[0]["mode"] == "lines"
    assert laws[0]["y"][-1] > 0.0, "the drive spends what friction takes"
    fixed = {"id": "coulomb_friction", "fc1": 1.2, "fc2": 0.4}
    assert session.document.change(lambda d: d.setdefault("model", {}).update(effects=[fixed]))
    assert session.demonstration.torques == ()
    assert session.demonstration.start("coulomb_friction")
    until(lambda: session.demonstration.shown is not None)
    session.diagnosis.versions = (
        ModelVersion(session.document.scenario, found=LOOKED, comparisons=(seen,)),
    )
    assert session.demonstration.torques == (), "an effect that is in the model is not missing"


def missing(joint: int) -> MissingTorque:
    """Of Coulomb friction, without noise."""
    time = np.linspace(0.0, 1.0, 50)
    speed = np.sin(20.0 * time)
    return MissingTorque(
        joint, "N m", time, speed, "rad/s", np.sign(speed), speed, np.ones(50, dtype=bool)
    )


LOOKED = ModelFindings(LadderStep(None, "As given", (), (), None, 81.0), (), (), (), ())
