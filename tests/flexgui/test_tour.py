"""The card of the tour follows from what has been done, and goes along with the person."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from flexgui.core.results import (
    MISSING,
    NOTHING,
    UNLISTED,
    ChannelError,
    Diagnosis,
    LadderStep,
    Outcome,
    RankedEffect,
)
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs.job import QUEUED, RUNNING, STOPPING, JobState
from flexgui.library.shipped import demo_scenario, hidden_scenario, is_of_tour
from flexgui.page.job_status import status_texts
from flexgui.page.panel import PageContext
from flexgui.page.tour import to_diagnosis, to_identification
from flexgui.scene.recorded_motion import RecordedMotion
from flexgui.session.scenario_edits import apply_edits
from flexgui.session.session import Session
from flexgui.session.state import STAGES
from flexgui.session.tour import OFFERED, STARTED, card, card_has_button
from flexgui.stages.diagnose.effects import with_effect
from flexgui.stages.diagnose.model_versions import (
    Change,
    ModelFindings,
    ModelVersion,
    error_rose,
    error_stayed,
    last_change,
)
from tests.approved import approved
from tests.session.helpers import alone

FRICTION, JOINT = "Coulomb friction", "Elastic joint"
WITH_FRICTION = apply_edits(hidden_scenario(), with_effect("coulomb_friction", None))


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    """On the tour, with nothing done yet."""
    made = alone("a-person", tmp_path / "own")
    made.document.scenario = hidden_scenario()
    made.tour.step = STARTED
    yield made
    made.close()


def fitted(session: Session, scenario: Scenario) -> None:
    """As after an identification of this scenario."""
    session.identification.outcome = cast(Outcome, SimpleNamespace(comparisons=()))
    session.identification.outcome_of = scenario


def ranked(title: str) -> RankedEffect:
    return RankedEffect(title.lower(), title, 9.0, 1e-9, 50.0, None, None)


def version(error: float, verdict: str | None, first: str, title: str = "") -> ModelVersion:
    """One look at a model whose error is so many floors; `title` of what was added to come here."""
    step = LadderStep(None, "", (), (ChannelError("z1", "m", error, 1.0),), None, error**2)
    diagnosis = None if verdict is None else Diagnosis(verdict, None, (), (step,), {})
    found = ModelFindings(
        step, ("th1",), (("z1",),), (0.1,), (np.ones((5, 1)),), (ranked(first),),
        diagnosis=diagnosis,
    )  # fmt: skip
    return ModelVersion(
        WITH_FRICTION if title else hidden_scenario(), title, title.lower() or None, found
    )


def go(session: Session, *versions: ModelVersion) -> None:
    """The way of these looks, at whose last model the person is."""
    session.diagnosis.versions = versions
    session.document.scenario = versions[-1].scenario if versions else hidden_scenario()


LACKING = version(9.7, MISSING, FRICTION)
ADDED = version(0.99, NOTHING, JOINT, FRICTION)
ROSE = [version(2.7, verdict, "Backlash", JOINT) for verdict in (MISSING, NOTHING, UNLISTED, None)]
FELL_HALFWAY = version(7.7, MISSING, FRICTION, "Viscous joint friction")
ADDING = ModelVersion(WITH_FRICTION, FRICTION, "coulomb friction")


HIDDEN, DEMO = hidden_scenario(), demo_scenario()
STATES: dict[str, dict[str, Any]] = {
    "dismissed": {"step": None},
    "offered": {"step": OFFERED, "scenario": DEMO},
    "on other recordings": {"scenario": DEMO},
    "nothing done": {},
    "nothing read yet": {"motion": None},
    "identifying": {"run": JobState(kind="identify", phase=RUNNING)},
    "just fitted": {"fitted": HIDDEN},
    "fitted at other settings": {"fitted": DEMO},
    "looking for it": {"pending": ModelVersion(HIDDEN)},
    "looking with a first list": {"pending": LACKING},
    "found": {"fitted": HIDDEN, "versions": (LACKING,)},
    "found and edited since": {"versions": (LACKING,), "scenario": WITH_FRICTION},
    "to be added when the list is done": {"pending": LACKING, "to_add": FRICTION},
    "adding": {"versions": (LACKING,), "pending": ADDING},
    "added and looking on": {
        "versions": (LACKING,), "pending": version(0.99, None, JOINT, FRICTION)
    },
    "added": {"versions": (LACKING, ADDED)},
    "added and undone": {"versions": (LACKING, ADDED), "undone": True},
    "added what did not help": {"versions": (LACKING, ADDED, ROSE[0])},
    "added what helped halfway": {"versions": (LACKING, FELL_HALFWAY)},
}  # fmt: skip


def bring(session: Session, state: dict[str, Any]) -> None:
    """Bring a session on the tour into a state."""
    session.tour.step = state.get("step", STARTED)
    go(session, *state.get("versions", ()))
    if state.get("undone"):
        go(session, *session.diagnosis.versions[:-1])
    session.document.scenario = state.get("scenario", session.document.scenario)
    session.playback.motion = cast(RecordedMotion | None, state.get("motion", SimpleNamespace()))
    session.diagnosis.pending = state.get("pending")
    session.diagnosis.to_add = state.get("to_add", "")
    session.run.state = state.get("run", session.run.state)
    if "fitted" in state:
        fitted(session, state["fitted"])


def test_the_card_of_every_state_at_every_stage(tmp_path: Path) -> None:
    lines = []
    for name, state in STATES.items():
        made = alone("a-person", tmp_path / name)
        bring(made, state)
        lines.append(f"## {name}\n")
        for made.stage in STAGES:
            shown = card(made)
            assert card_has_button(made) == (shown is not None and bool(shown.button))
            if shown is not None:
                button = f" [{shown.button}]" if shown.button else ""
                lines.append(f"- {made.stage}: **{shown.title}** {shown.text}{button}")
        lines.append("")
        made.close()
    approved("tour.md", "\n".join(lines))


@pytest.mark.parametrize("last", ROSE)
def test_an_error_that_did_not_fall_is_undone_whatever_the_verdict(
    session: Session, last: ModelVersion
) -> None:
    go(session, LACKING, ADDED, last)
    session.stage = "Diagnose"
    shown = card(session)
    assert shown is not None and "did not fall" in shown.text and "Backlash" not in shown.text


def test_an_effect_in_the_model_leaves_the_recordings_those_of_the_tour() -> None:
    assert is_of_tour(WITH_FRICTION)
    assert not is_of_tour(demo_scenario())


def test_a_change_that_figures_do_not_show_is_none() -> None:
    assert Change(9.7, 0.99).fell
    assert not Change(0.99, 0.989).fell
    assert not Change(0.99, 2.7).fell
    assert last_change((LACKING,)) is None
    assert not error_stayed((LACKING, ADDED))
    needless = (ADDED, version(0.99, NOTHING, "Backlash", JOINT))
    assert error_stayed(needless) and not error_rose(needless)
    assert error_rose((ADDED, ROSE[2]))


COMPILING = "Slow sensor (still to be compiled, once: Soft base)"
TRYING = {"phase": RUNNING, "stage": "Trying every known effect", "done": 11, "total": 29}


@pytest.mark.parametrize(
    ("state", "said"),
    [
        ({**TRYING, "text": COMPILING}, ("Trying every known effect, 11 of 29", ": Slow sensor",
                                         "Still to be compiled, once: Soft base")),
        ({**TRYING, "text": "Slow sensor"}, ("Trying every known effect, 11 of 29",
                                             ": Slow sensor", "")),
        ({**TRYING, "text": COMPILING, "simulations": 1234},
         ("Trying every known effect, 11 of 29", ": Slow sensor",
          "1,234 simulations, still to be compiled, once: Soft base")),
        ({"phase": QUEUED, "place": 2}, ("Waiting, place 2 in the queue.", "", "")),
        ({"phase": QUEUED, "place": 0}, ("A worker process is being started.", "", "")),
        ({"phase": QUEUED}, ("Waiting.", "", "")),
        ({"phase": STOPPING, "stage": "x"}, ("Stopping …", "", "")),
    ],
)  # fmt: skip
def test_progress_is_one_sentence_and_what_is_compiled_stands_apart(
    state: dict[str, str], said: tuple[str, str, str]
) -> None:
    assert status_texts(JobState("diagnose", **state)) == said  # type: ignore[arg-type]


@pytest.mark.parametrize("tours", [True, False])
def test_on_the_tour_the_way_on_begins_what_is_done_there(
    session: Session, monkeypatch: pytest.MonkeyPatch, tours: bool
) -> None:
    begun: list[str] = []
    monkeypatch.setattr(session.identification, "start", lambda: begun.append("fit"))
    monkeypatch.setattr(session.diagnosis, "search", lambda: begun.append("search"))
    session.tour.step = STARTED if tours else None
    context = cast(PageContext, SimpleNamespace(session=session, services=None))
    to_identification(context)
    assert session.stage == "Identify"
    to_diagnosis(context)
    assert session.stage == "Diagnose"
    assert begun == (["fit", "search"] if tours else [])
    fitted(session, session.document.scenario)
    go(session, LACKING)
    to_identification(context)
    to_diagnosis(context)
    assert len(begun) == (2 if tours else 0)
