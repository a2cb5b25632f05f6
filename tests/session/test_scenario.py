"""Changes of a session's scenario; arm and drive chosen on the page give one that can be run."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.loading import simulated
from flexgui.core.progress import Silent
from flexgui.core.recording.read_table import read_table
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.scenario.read import parse_scenario, scenario_toml
from flexgui.core.scenario.rig_spec import SensorsSpec
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.sensors import sensors
from flexgui.library.shipped import demo_scenario, hidden_scenario, scenario_choices, scenarios
from flexgui.session.scenario_edits import apply_edits, set_arm, set_value, with_lists
from flexgui.session.session import Session
from flexgui.session.state import PagePart, Topic
from flexgui.stages.data.inspect import CONTRADICT, inspect_file
from flexgui.stages.data.rigs import (
    RIGS,
    Experiments,
    arm_choices,
    arm_edit,
    has_working_points,
    rig_edit,
    rig_of,
)
from flexgui.stages.data.waiting_file import (
    WaitingFile,
    columns_of_rigs,
    waiting_again,
    waiting_for,
    wanted_channels,
)


@given(st.floats(2e8, 3e9), st.integers(0, 3))
def test_what_the_page_changes_survives_the_file(modulus: float, modes: int) -> None:
    scenario = demo_scenario()
    changed = apply_edits(
        scenario,
        set_arm(scenario, "young_modulus", modulus),
        set_arm(scenario, "modes", [modes, 1]),
    )
    assert parse_scenario(scenario_toml(changed), "x") == changed


def test_bounds_move_with_the_value_that_they_are_about(session: Session) -> None:
    session.document.change(set_arm(session.document.scenario, "young_modulus", 2e9))
    assert session.document.scenario.identify.bounds["epsilon"] == pytest.approx((1.6e9, 2.4e9))


@pytest.mark.parametrize("dragging", [False, True])
@pytest.mark.parametrize(
    ("place", "value"),
    [(("identify", "population"), 1), (("drive", "gains"), [60.0]), (("arm", "width"), -1.0)],
    ids=["population", "gains", "width"],
)
def test_a_bad_change_changes_nothing_and_says_why(
    session: Session, place: tuple[str, ...], value: object, dragging: bool
) -> None:
    before = session.document.scenario
    assert not session.document.change(set_value(place, value), dragging=dragging)
    assert session.document.scenario is before
    assert session.message.bad and place[1] in session.message.text


def test_a_subscriber_that_fails_is_told_of_and_hides_no_news_from_others(session: Session) -> None:
    heard: list[Topic] = []
    session.subscribe(lambda topic: 1 / 0)
    leave = session.subscribe(heard.append)
    session.show("Data")
    leave()
    session.show("Arm")
    assert heard == [Topic.MESSAGE, Topic.STAGE] and session.faults.outdated == {PagePart.PAGE}


def test_experiments_replace_the_simulated_recordings_only(session: Session) -> None:
    assert apply_edits(demo_scenario()) == demo_scenario()
    papers = apply_edits(demo_scenario(), Experiments().edit(20.0)).recordings
    assert [s.name for s in papers] == [s.name for s in demo_scenario().recordings]
    session.document.set_noise(30.0)
    levels = [s.simulate.snr_db for s in session.document.scenario.recordings if s.simulate]
    assert levels == [30.0] * 7 + [None], "the sweep has none"
    session.document.change(lambda d: d["recordings"].append({"file": "mine.csv"}))
    session.document.change(Experiments(count=3, sweep=False).edit(None))
    files = [spec.file for spec in session.document.scenario.recordings]
    assert files == [None, None, None, "mine.csv"]


def test_every_ready_made_scenario_can_be_opened_or_says_what_is_missing(session: Session) -> None:
    assert set(scenarios()) < set(scenario_choices()), "one list for page and command line"
    for name in scenario_choices():
        opened = session.choose(name)
        assert opened or "was not found" in session.message.text


@pytest.mark.parametrize("scenario", [demo_scenario(), hidden_scenario()], ids=lambda s: s.title)
def test_every_sensor_of_the_demos_has_noise(scenario: Scenario) -> None:
    """A sensor without noise fixes the stiffness to some parts in a million; no rig can."""
    spec, model = scenario.recordings[0], base_model(scenario)
    assert spec.simulate
    silent = spec.model_copy(update={"simulate": spec.simulate.model_copy(update={"snr_db": None})})
    noisy, exact = simulated(spec, scenario.sensors, model), simulated(silent, SensorsSpec(), model)
    own = [one for one in sensors().values() if one.noise]  # others follow from these
    names = {c.name for one in own for c in one.channels(model.arm)} & set(noisy.channels)
    assert names >= {"theta1", "z1", "deflection1", "u1"}
    assert [n for n in sorted(names) if np.array_equal(noisy[n], exact[n])] == []


DATA = Path(os.environ.get("FLEXGUI_DATA", ""))
needs_data = pytest.mark.skipif(
    not (DATA / "emps.csv").is_file(), reason="the real recordings are not here: FLEXGUI_DATA"
)


def chosen(arm: str, rig: str) -> Scenario:
    """The demonstration with another arm, then another rig."""
    found = demo_scenario()
    one = next(r for r in RIGS if r.title == rig)
    for make in (lambda s: arm_edit(s, arm), lambda s: rig_edit(s, one)):
        document = with_lists(found.model_dump(exclude_defaults=True))
        make(found)(document)
        found = Scenario.model_validate(document)
    return found


@pytest.mark.parametrize("rig", [r.title for r in RIGS])
@pytest.mark.parametrize("arm", arm_choices().values())
def test_every_rig_with_every_arm_is_a_scenario(arm: str, rig: str) -> None:
    found = chosen(arm, rig)
    model = base_model(found)
    assert set(found.identify.parameters) <= set(model.parameters)
    one = rig_of(found)
    assert one is not None and one.kind == next(r.kind for r in RIGS if r.title == rig)
    slide = rig.startswith("Slide")
    assert (found.arm.preset == "single_axis") == slide or arm == "single_axis"
    follows = rig in ("Velocity loops", "Position loops") and found.arm.preset != "single_axis"
    assert has_working_points(found) == follows, "a second joint follows references"


def first_look(scenario: Scenario, file: str) -> WaitingFile:
    model = base_model(scenario)
    references = tuple(model.drive.needed_channels(model.arm))
    wanted = wanted_channels(model.arm, references)
    found = inspect_file(str(DATA), file, scenario, wanted, progress=Silent())
    headings = tuple(read_table(DATA / file).columns)
    spec = RecordingSpec(file=file)
    return waiting_again(headings, model.arm, references, spec).guessed(found)


SUITED = {
    "emps.csv": "Slide, force recorded",
    "quanser_2dsfl_steps.csv": "Current recorded",
    "rigs/kukaA.csv": "",  # a torque of one joint that turns: no slide
}


@needs_data
@pytest.mark.parametrize("file", SUITED)
def test_columns_say_of_which_kind_of_rig_they_are(file: str) -> None:
    scenario, path = demo_scenario(), DATA / file
    rigs = columns_of_rigs(scenario)
    found = inspect_file(
        str(path.parent), path.name, scenario, rigs[0].wanted, rigs=rigs, progress=Silent()
    )
    assert found.rig == SUITED[file]
    waiting = waiting_for(path.name, found.headers, base_model(scenario).arm, rigs[0].needed)
    assert waiting is not None and waiting.guessed(found).suits == found.rig


@needs_data
def test_nothing_is_asked_about_the_recorded_slide() -> None:
    waiting = first_look(chosen("single_axis", "Slide, force recorded"), "emps.csv")
    assert not waiting.questions and not waiting.inspection.findings
    assert {c: e["name"] for c, e in waiting.columns.items()} == {"theta1": "q", "u1": "force"}


@needs_data
@pytest.mark.parametrize(
    "file", ["quanser_2dsfl_steps.csv", pytest.param("ctu_2dsfl_lqr.csv", marks=pytest.mark.long)]
)
def test_nothing_contradicts_the_bench_once_its_arm_is_chosen(file: str) -> None:
    scenario = chosen("two_stage_bench", "Current recorded")
    document = with_lists(scenario.model_dump(exclude_defaults=True))
    set_value(("drive", "torque_constants"), [8.925, 0.87])(document)
    waiting = first_look(Scenario.model_validate(document), file)
    assert not waiting.questions
    assert not {fault for fault, _ in waiting.inspection.findings.values()} & set(CONTRADICT)
