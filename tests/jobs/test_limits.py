"""Jobs that want more memory or time than they may have."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest

from flexgui.jobs import Failed, Finished, JobPool, WorkerLost
from flexgui.jobs.messages import PoolSettings
from tests.jobs.helpers import PATIENCE, Listener, process_id, sevens, sleep_deaf, spin, task

ROOM = 100_000_000
"""Bytes: much more than Python's own workings need, little enough to be asked for at once."""

SECONDS = 3.0
"""Of which a job that does nothing needs a thousandth, once its worker has loaded what it needs."""

SETTINGS = PoolSettings(
    grace=1.0, kept=9, warm_up="tests.jobs.helpers:loaded", niceness=0, memory=ROOM,
    seconds=SECONDS,
)  # fmt: skip


@pytest.fixture(scope="module")
def pool() -> Iterator[JobPool]:
    with JobPool(1, SETTINGS) as pool:
        yield pool


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the memory of a process")
def test_too_much_memory_is_a_sentence_and_the_worker_stays(pool: JobPool) -> None:
    heard = Listener()
    assert pool.submit("a", task(process_id), Listener()).wait(PATIENCE)
    before = pool.worker_pids
    pool.submit("a", task(sevens, size=ROOM // 4), heard)
    failed = heard.wait_for(Failed)
    assert failed.sentence.startswith("The test needs more memory than is allowed")
    again = Listener()
    pool.submit("a", task(sevens, size=1000), again)
    assert len(again.wait_for(Finished).result) == 1000
    assert pool.worker_pids == before


@pytest.mark.long
@pytest.mark.parametrize("work", [sleep_deaf, spin])
def test_too_much_time_is_a_sentence_and_the_next_job_runs(pool: JobPool, work) -> None:  # type: ignore[no-untyped-def]
    heard, after = Listener(), Listener()
    pool.submit("a", task(work, seconds=10 * PATIENCE), heard)
    pool.submit("a", task(sevens, size=3), after)
    assert heard.wait_for(Failed).sentence.startswith("The test took longer than 3 s")
    assert not heard.of(WorkerLost)
    assert len(after.wait_for(Finished).result) == 3
