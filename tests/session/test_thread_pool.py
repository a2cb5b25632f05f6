"""Threads that come with work and go without it."""

from __future__ import annotations

import threading
import time

import pytest

from flexgui.jobs import inbox
from flexgui.jobs.inbox import ThreadPool
from flexgui.session.scheduling import LatestRequest
from flexgui.session.state import Faults, PagePart
from tests.session.helpers import until

FAULTS = Faults(lambda: None)
SHORT = 0.2
"""s"""


def serving() -> int:
    return sum(thread.name == "flexgui-pool" for thread in threading.enumerate())


def test_threads_serve_whoever_has_work_and_end_soon_after() -> None:
    crew, done, before = ThreadPool(SHORT), list[int](), serving()
    for k in range(50):
        crew.run(lambda k=k: done.append(k))  # type: ignore[misc]
        until(lambda k=k: len(done) == k + 1)  # type: ignore[misc]
        assert serving() - before <= 2
    assert done == list(range(50))
    until(lambda: serving() <= before)


def test_long_work_holds_up_nobody_else() -> None:
    crew, held, done = ThreadPool(SHORT), threading.Event(), threading.Event()
    for _ in range(40):
        crew.run(held.wait)  # type: ignore[arg-type]
    crew.run(done.set)
    assert done.wait(5.0)
    held.set()


def test_a_hundred_workers_at_rest_have_no_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inbox, "THREADS", ThreadPool(SHORT))
    before = serving()
    workers = [LatestRequest(FAULTS, PagePart.MODEL) for k in range(100)]
    done: list[int] = []
    for k, worker in enumerate(workers):
        worker.request(lambda k=k: done.append(k))  # type: ignore[misc]
    assert all(worker.wait_idle(5.0) for worker in workers) and sorted(done) == list(range(100))
    until(lambda: serving() <= before)


def test_of_many_wishes_the_first_and_the_newest_are_granted_one_at_a_time() -> None:
    worker, begun, done = LatestRequest(FAULTS, PagePart.MODEL), threading.Event(), list[int]()
    go_on = threading.Event()
    worker.request(lambda: (begun.set(), go_on.wait(5.0), done.append(0))[0])
    assert begun.wait(5.0)
    for k in range(1, 100):
        worker.request(lambda k=k: done.append(k))  # type: ignore[misc]
    go_on.set()
    assert worker.wait_idle(5.0) and done == [0, 99]
    worker.close()
    worker.request(lambda: done.append(-1))
    time.sleep(SHORT)
    assert done == [0, 99]
