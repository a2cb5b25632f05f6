"""Identification from a session."""

from __future__ import annotations

import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
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
from tests.session.conftest import SOON
from tests.session.helpers import LONG, bring, exported, good_csv, small, until

SAME = 1e-9
"""Relative: the same code on the same data; results go through a file with all their digits."""


def test_run_follows_its_events() -> None:
    generation = Generation(1, 1.0, 2.0, 3.0, None)  # type: ignore[arg-type]
    run = JobState(kind="identify").after(Queued(2))
    assert (run.phase, run.place) == (QUEUED, 2)
    run = run.after(Started()).after(Stage("Identifying", 10)).after(Advanced(4))
    assert (run.phase, run.share, run.place) == (RUNNING, 0.4, None)
    run = run.after(NewGeneration("all", generation))
    assert run.history["all"] == (generation,)
    assert run.after(NewGeneration("all", generation)).history["all"] == (generation,) * 2
    assert run.after(Finished(None)).phase == DONE


def test_simulations_are_counted_in_each_stage() -> None:
    run = JobState(kind="diagnose")
    for event in (Stage("Fitting", 3), Advanced(0, simulations=40), Advanced(1, "th1")):
        run = run.after(event)
    run = run.after(Advanced(0, simulations=1200))
    assert (run.done, run.text, run.simulations) == (1, "th1", 1240)
    assert "1,240 simulations" in WORDS.state(run, None)
    assert run.after(Stage("Next")).simulations == 0


def test_only_the_newest_population_is_kept() -> None:
    """Thousands of generations of a long search would stay in memory."""
    run = JobState(kind="identify")
    for k in range(3):
        members = np.ones((4, 2))
        run = run.after(NewGeneration("all", Generation(k, 1.0, 2.0, 3.0, np.ones(2), members)))
    assert [g.population is None for g in run.history["all"]] == [True, True, False]


def test_how_far_a_file_is_read_stands_in_the_sentence() -> None:
    run = JobState(kind="identify")
    for event in (Started(), Stage("Reading the recordings", 1), Advanced(0, "th1.csv, 40% read")):
        run = run.after(event)
    assert "Reading the recordings 0 of 1: th1.csv, 40% read." in WORDS.state(run, None)


def test_identification_gives_an_outcome_that_plays(session: Session) -> None:
    small(session)
    assert session.identification.start()
    until(lambda: session.identification.outcome is not None)
    assert session.run.state.phase == DONE and session.run.state.history
    so_far, outcome = session.identification.so_far, session.identification.outcome
    assert so_far.comparison is not None and so_far.costs and outcome is not None
    assert live_worst([so_far.comparison]) is not None and live_descent(so_far.costs) is not None
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


def test_a_second_job_is_refused_in_words(session: Session) -> None:
    session.document.change(lambda d: d["identify"].update(LONG))
    assert session.identification.start()
    assert not session.identification.start()
    assert "already" in session.message.text
    session.run.stop()
    until(lambda: not session.run.state.busy)


def test_stop_keeps_the_last_complete_result(session: Session) -> None:
    small(session)
    session.identification.start()
    until(lambda: session.identification.outcome is not None)
    complete = session.identification.outcome
    assert session.document.change(lambda d: d["identify"].update(LONG))
    assert session.identification.start()
    until(lambda: bool(session.run.state.history))
    session.run.stop()
    until(lambda: session.run.state.phase == STOPPED)
    assert session.identification.outcome is complete


def test_stop_without_an_earlier_result_shows_the_best_so_far(session: Session) -> None:
    session.document.change(lambda d: d["identify"].update(LONG))
    session.identification.start()
    until(lambda: bool(session.run.state.history))
    session.run.stop()
    until(lambda: session.identification.outcome is not None)
    assert (
        session.identification.outcome is not None
        and session.identification.outcome.fits[0].stopped
    )


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


def test_report_is_written_by_the_pool(session: Session) -> None:
    assert not session.export.report(lambda folder: None)
    small(session)
    session.identification.start()
    until(lambda: session.identification.outcome is not None)
    until(lambda: session.run.job is None or session.run.job.over)
    done: list[Path] = []
    assert session.export.report(done.append)
    until(lambda: bool(done))
    assert (done[0] / "report.html").stat().st_size > 0


def test_a_job_of_a_scenario_that_was_left_is_not_heard_of_again(session: Session) -> None:
    session.document.change(lambda d: d["identify"].update(LONG))
    session.identification.start()
    until(lambda: bool(session.run.state.history))
    job = session.run.job
    session.choose("demo")
    assert job is not None
    until(lambda: job.over)
    assert (
        session.identification.outcome is None
        and not session.run.state.busy
        and not session.message.text
    )


def exporting(session: Session) -> tuple[ExportPanel, dict[str, bytes]]:
    """A panel without a page, and what it sends to the browser."""
    panel, sent = ExportPanel.__new__(ExportPanel), dict[str, bytes]()

    def send(name: str, content: bytes, **options: object) -> None:
        sent[name] = content

    client = SimpleNamespace(send_file_download=send)
    panel.context = cast(Any, SimpleNamespace(client=client, session=session))
    return panel, sent


def test_everything_says_which_recording_it_lacks(session: Session) -> None:
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
