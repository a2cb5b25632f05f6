"""What an effect does to the arm, without a page."""

from __future__ import annotations

import numpy as np

from flexgui.core.results import LadderStep, MissingTorque, RecordingComparison
from flexgui.session.session import Session
from flexgui.stages.diagnose.model_versions import ModelFindings, ModelVersion
from flexgui.stages.diagnose.plots import demonstration, demonstration_summary
from flexgui.views.missing_torque import missing_cloud
from tests.session.helpers import shortened, until


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
    listed = ("torque_ripple", "extra_bending_mode", "sensor_lag", "sensor_gain", "sensor_delay")
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
    assert session.document.change(lambda d: d["recordings"][0].update(role="validate"))
    assert session.demonstration.torques == ()


def test_an_effect_that_is_in_the_model_is_not_drawn_into_what_the_model_lacks(
    session: Session,
) -> None:
    short(session)
    fixed = {"id": "coulomb_friction", "fc1": 1.2, "fc2": 0.4}
    assert session.document.change(lambda d: d.setdefault("model", {}).update(effects=[fixed]))
    assert session.demonstration.start("coulomb_friction")
    until(lambda: session.demonstration.shown is not None)
    assert session.demonstration.shown is not None
    seen = RecordingComparison(
        session.demonstration.shown.recording, "estimate", "", (), (missing(1), missing(2))
    )
    session.diagnosis.versions = (
        ModelVersion(session.document.scenario, found=LOOKED, comparisons=(seen,)),
    )
    assert session.demonstration.torques == ()


def missing(joint: int) -> MissingTorque:
    """Of Coulomb friction, without noise."""
    time = np.linspace(0.0, 1.0, 50)
    speed = np.sin(20.0 * time)
    return MissingTorque(
        joint, "N m", time, speed, "rad/s", np.sign(speed), speed, np.ones(50, dtype=bool)
    )


LOOKED = ModelFindings(LadderStep(None, "As given", (), (), None, 81.0), (), (), (), ())
