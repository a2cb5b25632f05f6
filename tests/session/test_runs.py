"""Identification, a profile and a planned experiment from a session."""

from __future__ import annotations

import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from flexgui.core.results import Generation
from flexgui.core.scenario.schema import Scenario
from flexgui.export.formats import model_formats
from flexgui.jobs import Event, Finished
from flexgui.jobs.job import DONE, QUEUED, RUNNING, STOPPED, JobState
from flexgui.jobs.messages import Advanced, NewGeneration, Queued, Stage, Started
from flexgui.session.session import Session
from flexgui.stages.data.uploads import scenario_file
from flexgui.stages.export.panel import ExportPanel
from flexgui.stages.identify.panel import WORDS
from flexgui.views.comparison import live_worst
from flexgui.views.convergence import live_descent
from flexgui.views.preview import planned
from flexgui.views.profile import interval_sentence
from tests.session.conftest import SOON
from tests.session.helpers import LONG, bring, exported, good_csv, shortened, small, until

SAME = 1e-9
"""Relative: the same code on the same data; results go through a file with all their digits."""


def test_run_follows_its_events() -> None:
    members = np.ones((4, 2))
    generation = Generation(1, 1.0, 2.0, 3.0, np.ones(2), members)
    run = JobState(kind="identify").after(Queued(2))
    assert (run.phase, run.place) == (QUEUED, 2)
    run = run.after(Started()).after(Stage("Identifying", 10)).after(Advanced(4))
    assert (run.phase, run.share, run.place) == (RUNNING, 0.4, None)
    run = run.after(NewGeneration("all", generation))
    assert run.history["all"] == (generation,)
    again = run.after(NewGeneration("all", generation)).history["all"]
    assert [g.population is None for g in again] == [True, False], "only the newest is kept"
    assert run.after(Finished(None)).phase == DONE
    counted = run.after(Advanced(0, simulations=40)).after(Advanced(1, "th1", simulations=1200))
    assert (counted.done, counted.text, counted.simulations) == (5, "th1", 1240)
    assert "Identifying 5 of 10: th1" in WORDS.state(counted, None)
    assert "1,240 simulations" in WORDS.state(counted, None)
    assert counted.after(Stage("Next")).simulations == 0, "they are counted in each stage"


def test_identification_gives_an_outcome_that_plays(session: Session) -> None:
    small(session)
    assert session.identification.start()
    until(lambda: session.identification.outcome is not None)
    assert session.run.state.phase == DONE and session.run.state.history
    so_far, outcome = session.identification.so_far, session.identification.outcome
    assert so_far.comparison is not None and so_far.costs and outcome is not None
    assert live_worst([so_far.comparison]) is not None
    steps = max(len(costs) for costs in so_far.costs.values())
    assert (live_descent(so_far.costs) is not None) == (steps > 1), "no chart of one dot"
    assert "Converged: yes" in " ".join(str(WORDS.converged(outcome.fits)).split())
    session.playback.refresh()
    assert session.wait_idle()
    assert session.playback.motion is not None and session.playback.motion.fitted


def test_nobody_begins_another_job_before_the_result_of_the_first_is_taken_over(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken, keep, said = threading.Event(), session.identification._identified, list[bool]()

    def late(event: Event, scenario: Scenario) -> None:
        if isinstance(event, Finished):
            taken.wait(SOON)
            said.append(session.run.busy)
        keep(event, scenario)

    monkeypatch.setattr(session.identification, "_identified", late)
    small(session)
    assert session.identification.start()
    until(lambda: session.run.job is not None and session.run.job.over)
    assert session.run.busy and not session.identification.start()
    taken.set()
    until(lambda: not session.run.busy)
    assert session.identification.outcome is not None
    assert said == [True], "whichever thread asks"


def test_stop_keeps_the_last_complete_result(session: Session) -> None:
    small(session)
    session.identification.start()
    until(lambda: session.identification.outcome is not None)
    complete = session.identification.outcome
    assert session.document.change(lambda d: d["identify"].update(LONG))
    assert session.identification.start()
    until(lambda: bool(session.run.state.history))
    assert not session.identification.start() and "already" in session.message.text
    session.run.stop()
    until(lambda: session.run.state.phase == STOPPED)
    assert session.identification.outcome is complete


def test_stop_without_an_earlier_result_shows_the_best_so_far(session: Session) -> None:
    session.document.change(lambda d: d["identify"].update(LONG))
    session.identification.start()
    until(lambda: bool(session.run.state.history))
    session.run.stop()
    until(lambda: session.identification.outcome is not None)
    outcome = session.identification.outcome
    assert outcome is not None and outcome.fits[0].stopped


def test_a_scenario_that_cannot_run_says_why(session: Session) -> None:
    session.document.change(lambda d: d["identify"].update(parameters=["epsilom"], bounds={}))
    session.identification.start()
    until(lambda: not session.run.state.busy)
    assert session.message.bad and "epsilom" in session.message.text


def test_downloaded_scenario_gives_the_same_numbers_on_the_command_line(
    session: Session, tmp_path: Path
) -> None:
    small(session)
    session.identification.start()
    until(lambda: session.identification.outcome is not None)
    name, content = scenario_file(session.document.scenario, session.folder)
    (tmp_path / name).write_bytes(content)
    told = exported(tmp_path / name, tmp_path / "out")["parameters"]
    assert session.identification.outcome is not None
    fit = session.identification.outcome.fits[0]
    ours = {e.name: e.value for e in (*fit.estimates, *fit.derived)}
    assert {p["name"]: p["value"] for p in told} == pytest.approx(ours, rel=SAME)


def test_a_job_of_a_scenario_that_was_left_is_not_heard_of_again(session: Session) -> None:
    session.document.change(lambda d: d["identify"].update(LONG))
    session.identification.start()
    until(lambda: bool(session.run.state.history))
    job = session.run.job
    session.choose("demo")
    assert job is not None
    until(lambda: job.over)
    assert session.identification.outcome is None
    assert not session.run.state.busy
    assert not session.message.text


def exporting(session: Session) -> tuple[ExportPanel, dict[str, bytes]]:
    """A panel without a page, and what it sends to the browser."""
    panel, sent = ExportPanel.__new__(ExportPanel), dict[str, bytes]()

    def send(name: str, content: bytes, **options: object) -> None:
        sent[name] = content

    client = SimpleNamespace(send_file_download=send)
    panel.context = cast(Any, SimpleNamespace(client=client, session=session))
    return panel, sent


def test_everything_says_which_recording_it_lacks(session: Session) -> None:
    assert not session.export.report(lambda folder: None), "there is no result yet"
    small(session)
    assert bring(session, "own.csv", good_csv(session))
    session.identification.start()
    until(lambda: not session.run.busy and session.identification.outcome is not None)
    (session.folder / "own.csv").unlink()
    panel, sent = exporting(session)
    panel.send_export("")
    until(lambda: not session.run.busy and bool(sent))
    assert session.message.bad
    assert "without recordings" in session.message.text and "own.csv" in session.message.text


def test_compilers_and_second_servers_run_in_no_process_of_a_page(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def here(*arguments: object, **options: object) -> None:
        raise AssertionError("in the page's process")

    monkeypatch.setattr("subprocess.run", here)
    monkeypatch.setattr("viser.ViserServer", here)
    small(session)
    session.identification.start()
    until(lambda: not session.run.busy and session.playback.motion is not None)
    panel, sent = exporting(session)
    for one in model_formats():
        panel._save_model(one)
        until(lambda: not session.run.busy)
    panel._save_playback()
    until(lambda: not session.run.busy)
    assert not session.message.bad, session.message.text
    endings = {name.rpartition("_")[2] for name in sent}
    assert endings >= {"model.fmu", "model.xml", "playback.html"}
    assert len(sent) == len(model_formats()) + 1


@pytest.fixture
def identified(session: Session) -> Session:
    session.choose("paper_glocal")
    small(session)
    assert session.identification.start()
    until(lambda: not session.run.busy)
    assert session.identification.current is not None
    return session


def test_a_profile_is_of_the_last_result_and_goes_with_it(identified: Session) -> None:
    found, name = identified.identification, identified.document.scenario.identify.parameters[0]
    assert found.find_profile(name, None)
    until(lambda: not identified.run.busy)
    assert found.profile is not None
    assert found.profile.estimate.name == name
    assert name in interval_sentence(found.profile)
    found.take(None, None)
    assert found.profile is None


def test_without_a_result_there_is_none(session: Session) -> None:
    assert not session.identification.find_profile("EI1", None)


@pytest.fixture
def brief(session: Session) -> Session:
    assert session.document.change(shortened(0, 1))
    return session


def test_the_files_to_play_and_the_words_are_handed_on(brief: Session) -> None:
    folders: list[Path] = []
    assert not brief.export.plan(2.0, {"speed": [-1.0]}, folders.append)
    assert "limits" in brief.message.text
    limits = {"speed": [0.3, 0.5]}
    assert brief.export.plan(2.0, limits, folders.append)
    until(lambda: not brief.run.busy)
    (folder,) = folders
    names = {path.name for path in folder.iterdir()}
    assert {"play1.csv", "expected1.csv", "plan.json", "plan.txt", "planned.toml"} <= names
    made = brief.export.planned
    assert made.words[0].startswith("Record ")
    figure = planned(made.references)
    assert figure is not None and planned(()) is None
    drawn = [tuple(trace["y"]) for trace in figure["data"]]
    play = pd.read_csv(folder / "play1.csv")
    assert max(abs(play["dtheta1_ref [rad/s]"])) == pytest.approx(max(map(abs, drawn[0])), rel=0.01)
    assert "limits" not in brief.document.scenario.model_dump(exclude_unset=True), (
        "it is left as it is"
    )
    text = (folder / "planned.toml").read_text(encoding="utf-8")
    assert "speed = [" in text and 'played = "play1.csv"' in text


@pytest.mark.long
def test_a_shorter_plan_leaves_nothing_of_the_one_before(brief: Session) -> None:
    folders: list[Path] = []
    for seconds, last in ((2.0, True), (1.0, False)):
        assert brief.export.plan(seconds, {}, folders.append)
        until(lambda: not brief.run.busy)
        assert (folders[-1] / "play2.csv").exists() is last
