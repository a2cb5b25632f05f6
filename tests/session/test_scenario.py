"""Changes of a session's scenario."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.loading import simulated
from flexgui.core.scenario.read import parse_scenario, scenario_toml
from flexgui.core.scenario.rig_spec import SensorsSpec
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.sensors import sensors
from flexgui.library.shipped import demo_scenario, hidden_scenario, scenario_choices, scenarios
from flexgui.session.scenario_edits import apply_edits, set_arm, set_value
from flexgui.session.session import Session
from flexgui.session.state import PagePart, Topic
from flexgui.stages.data.rigs import Experiments


def test_demo_is_a_scenario_that_needs_no_file() -> None:
    assert all(spec.file is None for spec in demo_scenario().recordings)


def test_an_edit_without_a_change_gives_an_equal_scenario() -> None:
    assert apply_edits(demo_scenario()) == demo_scenario()


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


def test_a_bad_change_changes_nothing_and_says_why(session: Session) -> None:
    before = session.document.scenario
    assert not session.document.change(set_value(("identify", "population"), 1))
    assert session.document.scenario == before
    assert session.message.bad and "population" in session.message.text


def test_a_refused_number_of_gains_is_said_before_anything_runs(session: Session) -> None:
    assert not session.document.change(set_value(("drive", "gains"), [60.0]))
    assert "gains" in session.message.text


def test_subscribers_hear_what_changed_until_they_leave(session: Session) -> None:
    heard: list[Topic] = []
    leave = session.subscribe(heard.append)
    session.show("Data")
    leave()
    session.show("Arm")
    assert heard == [Topic.STAGE]


def test_a_subscriber_that_fails_is_told_of_and_hides_no_news_from_others(
    session: Session,
) -> None:
    heard: list[Topic] = []
    session.subscribe(lambda topic: 1 / 0)
    session.subscribe(heard.append)
    session.show("Data")
    assert heard == [Topic.MESSAGE, Topic.STAGE] and session.faults.outdated == {PagePart.PAGE}


def test_experiments_replace_the_simulated_recordings_only(session: Session) -> None:
    session.document.change(lambda d: d["recordings"].append({"file": "mine.csv"}))
    session.document.change(Experiments(count=3, sweep=False).edit(None))
    files = [spec.file for spec in session.document.scenario.recordings]
    assert files == [None, None, None, "mine.csv"]


def test_default_experiments_are_the_papers() -> None:
    changed = apply_edits(demo_scenario(), Experiments().edit(20.0))
    assert [s.name for s in changed.recordings] == [s.name for s in demo_scenario().recordings]


def test_noise_reaches_the_experiments_and_not_the_sweep(session: Session) -> None:
    session.document.set_noise(None)
    assert all(
        s.simulate and s.simulate.snr_db is None for s in session.document.scenario.recordings
    )
    session.document.set_noise(30.0)
    levels = [s.simulate.snr_db for s in session.document.scenario.recordings if s.simulate]
    assert levels == [30.0] * 7 + [None]


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


def test_close_removes_the_folder_and_silences(session: Session, tmp_path: Path) -> None:
    session.close()
    assert not session.folder.exists()
