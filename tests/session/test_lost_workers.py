"""A worker that dies or stops under any kind of job: told in words, and the next try succeeds."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from flexgui.jobs import JobPool, file_jobs
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from flexgui.stages.study.state import DONE
from tests.jobs.helpers import EVEN
from tests.paper_study.helpers import short
from tests.session.conftest import Offered
from tests.session.helpers import good_csv, small, until

pytestmark = pytest.mark.long

SILENCE = 15.0
"""s until a stopped worker is said to hang: seven signs of life, so that no busy one is."""
WARM = 300.0
"""s for a worker to take the place of a lost one, on a busy machine."""

Try = Callable[[Session], bool]
"""Does something that a worker is needed for; whether it succeeded."""


@pytest.fixture(scope="module")
def services() -> Iterator[Offered]:
    with JobPool(1, replace(EVEN, silence=SILENCE)) as pool:
        yield Offered(pool)


@pytest.fixture(scope="module")
def readers() -> Iterator[JobPool]:
    with JobPool(1, replace(file_jobs.SETTINGS, silence=SILENCE, niceness=0)) as pool:
        yield pool


@pytest.fixture
def identified(session: Session) -> Session:
    assert session.choose("something hidden")
    small(session)
    assert session.document.change(set_value(("diagnose", "candidates"), ["coulomb_friction"]))
    assert session.identification.start()
    until(lambda: not session.run.busy, WARM)
    assert session.identification.outcome is not None, session.message
    return session


def idle(session: Session, before: object, found: Callable[[], object]) -> bool:
    until(lambda: not session.run.busy, WARM)
    return found() is not before


def identify(session: Session) -> bool:
    before = session.identification.outcome
    assert session.identification.start()
    return idle(session, before, lambda: session.identification.outcome)


def diagnose(session: Session) -> bool:
    before = session.diagnosis.versions
    assert session.diagnosis.search()
    return idle(session, before, lambda: session.diagnosis.versions)


def add(session: Session) -> bool:
    model = session.document.scenario.model
    assert session.diagnosis.add("coulomb_friction")
    until(lambda: not session.run.busy and session.diagnosis.pending is None, WARM)
    return session.document.scenario.model != model


def report(session: Session) -> bool:
    done: list[Path] = []
    assert session.export.report(done.append)
    until(lambda: not session.run.busy, WARM)
    return bool(done)


def hide(session: Session) -> bool:
    said = session.message.number
    assert session.challenge.hide(3, "easy")
    until(lambda: session.challenge.state is not None or session.message.number > said, WARM)
    return session.challenge.state is not None


def demonstrate(session: Session) -> bool:
    session.demonstration.start("coulomb_friction")
    until(
        lambda: session.demonstration.shown is not None or session.demonstration.not_shown != "",
        WARM,
    )
    if session.demonstration.shown is None:
        session.show_message(session.demonstration.not_shown, bad=True)
    return session.demonstration.shown is not None


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.parametrize("attempt", [identify, diagnose, add, report, demonstrate, hide])
def test_a_lost_worker_costs_one_try(
    identified: Session, services: Offered, attempt: Try, number: int
) -> None:
    lose_worker(services.pool, number)
    outcome, versions = identified.identification.outcome, identified.diagnosis.versions
    assert not attempt(identified)
    assert identified.message.bad and "start it again" in identified.message.text
    assert (identified.identification.outcome, identified.diagnosis.versions) == (outcome, versions)
    assert attempt(identified), identified.message


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_lost_worker_costs_a_study_nothing(
    session: Session, services: Offered, number: int
) -> None:
    assert session.open(short().scenario)
    session.study.choose(runs=2, at_once=1)
    lose_worker(services.pool, number)
    assert session.study.start()
    until(lambda: not session.study.state.busy, WARM)
    assert (session.study.state.phase, session.study.state.done) == (DONE, 4), (
        session.study.state.sentence
    )


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_lost_reader_costs_one_upload(
    session: Session,
    readers: JobPool,
    number: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(file_jobs, "_pool", cache(lambda: readers))
    content = good_csv(session)
    before = {path.name for path in session.folder.iterdir()}
    lose_worker(readers, number)
    assert not session.recordings.upload("own.csv", content).result()
    assert session.message.bad and "own.csv" in session.message.text
    assert {path.name for path in session.folder.iterdir()} == before
    assert session.recordings.upload("own.csv", content).result(), session.message


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_lost_worker_costs_one_long_simulation(
    session: Session, readers: JobPool, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_jobs, "_pool", cache(lambda: readers))
    assert session.document.change(set_value(("recordings", 0, "simulate", "seconds"), 31.0))
    assert session.wait_idle(WARM)
    session.playback.recording = session._recording_key = None
    lose_worker(readers, number)
    session.playback.refresh()
    assert session.wait_idle(WARM) and session.playback.recording is None
    assert session.message.bad and "Recording" in session.message.text
    session.playback.refresh()
    assert session.wait_idle(WARM)
    assert session.playback.recording is not None and len(session.playback.recording.time) == 31_000


def lose_worker(pool: JobPool, number: int) -> None:
    """It stands still before it gets the job; then it is killed, or not."""
    pool.start()
    until(lambda: pool.workers_ready == 1, WARM)
    (worker,) = pool.worker_pids
    os.kill(worker, signal.SIGSTOP)
    if number == signal.SIGKILL:
        kill_once_it_has_a_job(pool, worker)


def kill_once_it_has_a_job(pool: JobPool, worker: int) -> None:
    def kill() -> None:
        until(lambda: bool(pool._active), WARM)
        os.kill(worker, signal.SIGKILL)

    threading.Thread(target=kill, daemon=True).start()
