"""The Monte Carlo study of a session."""

from __future__ import annotations

import json
import os
import signal
import zipfile
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest

from flexgui.core.montecarlo.settings import make_settings
from flexgui.core.montecarlo.study import study
from flexgui.core.montecarlo.summary import summarise
from flexgui.core.resumable.executor import Here
from flexgui.core.resumable.journal import Journal
from flexgui.core.scenario.read import parse_scenario, read_scenario, scenario_toml
from flexgui.server.services import Services
from flexgui.session.session import Session
from flexgui.session.state import Topic
from flexgui.stages.data.uploads import zipped_folder
from flexgui.stages.study.state import DONE, FAILED, IDLE, STOPPED, remaining, shown
from flexgui.stages.study.task import JOURNAL
from tests.montecarlo.helpers import numbers, records_of, short
from tests.session.helpers import until

MANY = 400
"""Runs that last until the test stops them."""

NOT_THE_PAPERS = Path(__file__).parents[2] / "scenarios" / "mujoco" / "tip_payload.toml"


@pytest.fixture
def quick(session: Session) -> Session:
    """With a scenario whose fits take a moment."""
    assert session.open(short().scenario)
    session.study.choose(runs=2, at_once=1)
    return session


def ended(session: Session) -> None:
    until(lambda: not session.study.state.busy)


def titles(session: Session) -> list[str]:
    return [section.title for section in session.study.state.sections]


def test_tables_and_figures_come_while_it_runs(quick: Session) -> None:
    seen: list[tuple[int, bool]] = []

    def told(topic: Topic) -> None:
        if topic is Topic.STUDY:
            seen.append((len(quick.study.state.sections), quick.study.state.busy))

    quick.subscribe(told)
    quick.study.choose(runs=MANY)
    quick.study.start()
    assert not quick.study.start() and "is running" in quick.message.text
    assert not quick.study.choose(runs=1)
    until(lambda: any(count and busy for count, busy in seen))
    until(lambda: quick.study.state.remaining_seconds is not None)
    quick.study.stop()
    ended(quick)
    assert titles(quick)[0] == "Estimates"
    assert "Estimates at" in quick.study.state.sections[0].words


def test_a_stopped_study_goes_on_and_repeats_nothing(quick: Session) -> None:
    quick.study.choose(runs=MANY)
    quick.study.start()
    until(lambda: quick.study.state.done >= 2)
    quick.study.stop()
    ended(quick)
    assert quick.study.state.phase == STOPPED and "kept" in quick.message.text
    run = quick.study.run
    assert run is not None
    before = (run.folder / JOURNAL).read_bytes()
    some = run.records
    quick.study.choose(runs=max(r["answer"]["run"] for r in some.values()) + 1)
    assert quick.study.start()
    ended(quick)
    assert quick.study.state.phase == DONE and quick.study.state.before == len(some)
    after = (run.folder / JOURNAL).read_bytes()
    assert after.startswith(before)
    keys = [json.loads(line).get("key") for line in after.splitlines()]
    assert len(keys) == len(set(keys))


def test_the_export_is_what_the_command_goes_on_from(quick: Session, tmp_path: Path) -> None:
    assert not quick.study.export(lambda folder: None)
    assert quick.message.bad
    quick.study.start()
    ended(quick)
    done: list[Path] = []
    assert quick.study.export(done.append)
    until(lambda: bool(done))
    with zipfile.ZipFile(BytesIO(zipped_folder(done[0]))) as archive:
        archive.extractall(tmp_path / "unpacked")
    out = tmp_path / "unpacked"
    names = {path.name for path in out.iterdir()}
    assert {"study.html", "result.json", "estimates.csv", "runs.csv", "scenario.toml"} <= names
    assert set(json.loads((out / "result.json").read_text())["files"]) <= names
    scenario = read_scenario(out / "scenario.toml")
    known = Journal(out / JOURNAL, make_settings(scenario, runs=2).identity).records
    assert len(known) == 4
    expected = records_of(study(short(runs=2), executor=Here(), only=["fits"]))
    assert numbers(known) == numbers(expected), "as without a page"
    keys = list(known)
    for count in range(1, len(keys) + 1):  # every beginning of a study can be shown
        some = {key: known[key] for key in keys[:count]}
        assert shown(summarise(short(runs=2), some))


def test_another_scenario_ends_the_study_of_the_first(quick: Session) -> None:
    quick.study.choose(runs=MANY)
    quick.study.start()
    until(lambda: quick.study.state.done >= 1)
    run = quick.study.run
    assert run is not None
    quick.choose("demo")
    assert quick.study.state.phase == IDLE and not quick.study.state.sections
    assert run.wait()
    done = run.state.done
    assert quick.open(short().scenario)
    quick.study.choose(runs=1)
    assert quick.study.start()
    ended(quick)
    assert quick.study.state.phase == DONE and quick.study.state.before == min(done, 2)
    assert not quick.message.bad


@pytest.mark.long
def test_a_killed_worker_costs_no_case(quick: Session, services: Services) -> None:
    quick.study.choose(runs=20)
    quick.study.start()
    until(lambda: quick.study.state.done >= 1)
    os.kill(services.pool.worker_pids[0], signal.SIGKILL)
    ended(quick)
    assert (quick.study.state.phase, quick.study.state.done) == (DONE, 40)


def test_a_closed_session_leaves_no_thread(quick: Session) -> None:
    quick.study.choose(runs=MANY)
    quick.study.start()
    run = quick.study.run
    assert run is not None
    quick.close()
    assert run.wait()
    assert not quick.folder.exists()


def test_other_sessions_have_their_turn_and_one_that_leaves_stops_its_study(
    quick: Session, services: Services, tmp_path: Path
) -> None:
    quick.study.choose(runs=MANY)
    quick.study.start()
    until(lambda: quick.study.state.done >= 1)
    (tmp_path / "other").mkdir()
    other = Session("another-person", tmp_path / "other", services)
    try:
        assert other.open(short().scenario)
        assert other.identification.start()
        until(lambda: other.identification.outcome is not None)
        assert quick.study.state.busy
    finally:
        other.close()
    services.pool.cancel_session(quick.key)
    ended(quick)
    assert quick.study.state.phase == STOPPED and quick.study.state.done < quick.study.state.total


def test_the_demo_can_be_studied_and_survives_toml(session: Session) -> None:
    """Else the exported journal would belong to another study than the exported scenario."""
    assert not session.study.refusal
    again = parse_scenario(scenario_toml(session.document.scenario), "again")
    assert make_settings(again).identity == make_settings(session.document.scenario).identity


def test_what_cannot_be_started_is_said(quick: Session) -> None:
    def refused(**choice: Any) -> str:
        quick.study.choose(**choice)
        assert not quick.study.start() and quick.message.bad
        return quick.message.text

    assert "Estimates" in refused(parts=())
    assert quick.document.change(
        lambda d: d["identify"].update(parameters=["EI1", "EI2"], bounds={})
    )
    assert "Estimates" in refused(parts=("prior",))


def test_a_scenario_of_files_says_why(session: Session) -> None:
    session.document.scenario = read_scenario(NOT_THE_PAPERS)
    assert "study" in session.study.refusal and session.study.refusal.count(".\n") == 0
    assert not session.study.start()
    assert session.message.bad and session.study.state.phase == IDLE


def test_a_failing_case_ends_the_study_in_a_sentence(quick: Session) -> None:
    assert quick.document.change(lambda d: d["identify"].update(parameters=["epsilom"], bounds={}))
    quick.study.start()
    ended(quick)
    assert quick.study.state.phase in (FAILED, IDLE)
    assert quick.message.bad and "epsilom" in quick.message.text


def test_time_left_follows_each_parts_own_pace() -> None:
    known = {
        "a": {"part": "fits", "seconds": 1.0},
        "b": {"part": "fits", "seconds": 3.0},
        "c": {"part": "baselines", "seconds": 40.0},
    }
    # 44 s of work took 22 s, so that two fits (2 s each) and one of the others (40 s) take 22 s.
    assert remaining(known, known, ["fits", "fits", "baselines"], 22.0) == pytest.approx(22.0)
    assert remaining(known, [], ["fits"], 22.0) is None
