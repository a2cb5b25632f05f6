"""A worker that is stopped, not dead: it is told to hang, and another one takes its place."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from flexgui.jobs import Finished, JobPool, WorkerLost, supervisor, worker
from flexgui.jobs.messages import ALIVE, Advanced
from tests.jobs.conftest import LIGHT
from tests.jobs.helpers import (
    MANY,
    PATIENCE,
    Listener,
    begun,
    count,
    eventually,
    half_a_message,
    process_id,
    size_of,
    sleep_deaf,
    task,
)

pytestmark = pytest.mark.long

SILENCE = 4.0
"""s: eight signs of life of these workers, so that a busy one is not taken for a hanging one."""
OFTEN = replace(LIGHT, silence=SILENCE, warm_up="tests.jobs.helpers:beat_often")


@pytest.fixture
def pool() -> Iterator[JobPool]:
    with JobPool(1, OFTEN) as made:
        yield made


def worker_of(pool: JobPool) -> int:
    _, heard = begun(pool, process_id)
    return int(heard.wait_for(Finished).result)


def test_a_stopped_worker_is_told_to_hang_and_replaced(pool: JobPool) -> None:
    before, heard = worker_of(pool), Listener()
    pool.submit("s", task(count, steps=MANY), heard)
    heard.wait_for(Advanced)
    os.kill(before, signal.SIGSTOP)
    said = heard.wait_for(WorkerLost, SILENCE + PATIENCE).sentence
    assert said.startswith("The test stopped responding") and said.endswith("start it again.")
    assert worker_of(pool) != before


def test_an_idle_worker_that_is_stopped_is_replaced(pool: JobPool) -> None:
    before = worker_of(pool)
    os.kill(before, signal.SIGSTOP)
    assert eventually(lambda: before not in pool.worker_pids, 2 * PATIENCE)
    assert worker_of(pool) != before


LARGE = np.zeros(2_000_000)
"""16 MB: more than any pipe holds."""


def test_a_worker_that_stands_still_while_it_is_sent_a_large_job_is_replaced(pool: JobPool) -> None:
    before, heard = worker_of(pool), Listener()
    os.kill(before, signal.SIGSTOP)
    pool.submit("s", task(size_of, values=LARGE), heard)
    said = heard.wait_for(WorkerLost, SILENCE + PATIENCE).sentence
    assert said.startswith("The test stopped responding") and said.endswith("start it again.")
    again = Listener()
    pool.submit("s", task(size_of, values=LARGE), again)
    assert again.wait_for(Finished, PATIENCE).result == LARGE.size


def test_a_worker_that_stands_still_in_the_middle_of_a_message_is_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(supervisor, "work", half_a_message)
    worker = supervisor.WorkerProcess(replace(OFTEN, silence=1.0))
    with pytest.raises(supervisor.WorkerGoneError):
        worker.receive(PATIENCE)
    assert worker.hangs
    worker.end(0.0)


def test_a_task_that_says_nothing_does_not_hang(pool: JobPool) -> None:
    _, heard = begun(pool, sleep_deaf, seconds=1.5 * SILENCE)
    heard.wait_for(Finished, SILENCE + PATIENCE)
    assert not heard.of(WorkerLost)


class Narrow:
    """A pipe whose first message finds no memory; nobody hears the third."""

    def __init__(self) -> None:
        self.heard: list[Any] = []

    def send(self, message: Any) -> None:
        self.heard.append(message)
        if len(self.heard) == 1:
            raise MemoryError
        if len(self.heard) == 3:
            raise OSError


def test_a_worker_whose_job_took_all_memory_goes_on_giving_signs_of_life(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(worker, "HEARTBEAT_INTERVAL", 0.0)
    pipe = Narrow()
    worker.Worker(cast(Any, pipe)).send_heartbeats()
    assert pipe.heard == [ALIVE] * 3
