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
from flexgui.server.services import Services
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from tests.jobs.helpers import EVEN
from tests.session.conftest import offered
from tests.session.helpers import good_csv, small, until

pytestmark = pytest.mark.long

SILENCE = 15.0
"""s until a stopped worker is said to hang: seven signs of life, so that no busy one is."""
WARM = 300.0
"""s for a worker to take the place of a lost one, on a busy machine."""


@pytest.fixture(scope="module")
def services() -> Iterator[Services]:
    with JobPool(1, replace(EVEN, silence=SILENCE)) as pool:
        yield offered(pool)


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


Try = tuple[Callable[[Session], bool], Callable[[Session], object]]
"""What begins a job, and what is another one once it has succeeded."""
REPORTS: list[Path] = []
TRIES: dict[str, Try] = {
    "identify": (lambda s: s.identification.start(), lambda s: id(s.identification.outcome)),
    "diagnose": (lambda s: s.diagnosis.search(), lambda s: len(s.diagnosis.versions)),
    "add": (lambda s: s.diagnosis.add("coulomb_friction"), lambda s: s.document.scenario.model),
    "report": (lambda s: s.export.report(REPORTS.append), lambda s: len(REPORTS)),
    "show": (lambda s: s.demonstration.start("coulomb_friction"), lambda s: s.demonstration.shown),
    "hide": (lambda s: s.challenge.hide(3, "easy"), lambda s: s.challenge.state),
}


def succeeds(session: Session, attempt: str) -> bool:
    begin, found = TRIES[attempt]
    before, said = found(session), session.message.number
    assert begin(session)
    if attempt in ("show", "hide"):
        until(
            lambda: (
                found(session) is not before
                or session.message.number > said
                or session.demonstration.not_shown != ""
            ),
            WARM,
        )
    until(lambda: not session.run.busy and session.diagnosis.pending is None, WARM)
    return bool(found(session) != before)


@pytest.mark.parametrize(
    ("attempt", "number"),
    [*((each, signal.SIGKILL) for each in TRIES), ("identify", signal.SIGSTOP)],
)
def test_a_lost_worker_costs_one_try(
    identified: Session, services: Services, attempt: str, number: int
) -> None:
    outcome, versions = identified.identification.outcome, identified.diagnosis.versions
    lose_worker(services.pool, number)
    assert not succeeds(identified, attempt)
    assert "start it again" in identified.message.text + identified.demonstration.not_shown
    assert (identified.identification.outcome, identified.diagnosis.versions) == (outcome, versions)
    assert succeeds(identified, attempt), identified.message


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_lost_reader_costs_one_upload(
    session: Session, readers: JobPool, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_jobs, "_pool", cache(lambda: readers))
    content = good_csv(session)
    before = {path.name for path in session.folder.iterdir()}
    lose_worker(readers, number)
    assert not session.recordings.upload("own.csv", content).result()
    assert session.message.bad and "own.csv" in session.message.text
    assert {path.name for path in session.folder.iterdir()} == before
    assert session.recordings.upload("own.csv", content).result(), session.message


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
