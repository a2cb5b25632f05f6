"""Whose turn it is, threads that come and go with work, and how often is drawn."""

from __future__ import annotations

import threading
import time

import pytest

from flexgui.jobs import inbox
from flexgui.jobs.inbox import ThreadPool
from flexgui.page import redraw
from flexgui.page.redraw import INTERVAL, LONG, SLOWEST, RedrawScheduler
from flexgui.session.scheduling import ComputeTurns, LatestRequest
from flexgui.session.state import Faults, PagePart, Topic
from tests.session.helpers import until

SOON = 5.0
"""s that a thread may take to be heard of."""


def waiting(lock: ComputeTurns, order: list[str], name: str, draws: bool) -> threading.Thread:
    """A thread that waits for its turn, and notes when it had it."""

    def run() -> None:
        with lock.for_drawing() if draws else lock.for_computing():
            order.append(name)

    def waits_or_had_it() -> bool:
        return name in order or len(lock._computing) + len(lock._drawing) > before

    before = len(lock._computing) + len(lock._drawing)
    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    limit = time.monotonic() + SOON
    while not waits_or_had_it() and time.monotonic() < limit:
        time.sleep(0.001)
    return thread


def test_who_ends_an_answer_goes_first_and_else_who_came_first() -> None:
    lock, order = ComputeTurns(), list[str]()
    with lock.for_computing():
        threads = [
            waiting(lock, order, "first", draws=False),
            waiting(lock, order, "second", draws=False),
            waiting(lock, order, "drawing", draws=True),
        ]
        assert order == []
    for thread in threads:
        thread.join(SOON)
    assert order == ["drawing", "first", "second"]


def test_a_turn_that_fails_is_handed_on() -> None:
    lock, order = ComputeTurns(), list[str]()
    with pytest.raises(ValueError, match="broken"), lock.for_drawing():
        raise ValueError("broken")
    waiting(lock, order, "next", draws=False).join(SOON)
    assert order == ["next"]


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


BEGUN = 100.0
"""s on the clock."""


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [BEGUN]
    monkeypatch.setattr(redraw.time, "monotonic", lambda: now[0])
    return now


def pause_after(clock: list[float], seconds: float, *dirty: Topic) -> float:
    """s until the next drawing, after drawings twice each second for so long."""
    redraw = RedrawScheduler(lambda _: None, lambda: None, lambda: True)
    for k in range(int(2 * seconds) + 1):
        clock[0] = BEGUN + 0.5 * k
        redraw._paint([Topic.RUN])
    redraw.close()
    return max(redraw._pause(list(dirty)), 0.0)


@pytest.mark.parametrize(
    ("streamed", "more", "pause"),
    [
        (0.0, (), INTERVAL),
        (LONG, (), 2.0 * INTERVAL),
        (100.0 * LONG, (), SLOWEST),
        (100.0 * LONG, (Topic.SCENARIO,), INTERVAL),
        (100.0 * LONG, (Topic.STAGE,), 0.0),
    ],
    ids=["begin", "stream", "stream for long", "an edit", "no stream"],
)
def test_what_streams_is_drawn_the_more_seldom_the_longer_it_does(
    clock: list[float], streamed: float, more: tuple[Topic, ...], pause: float
) -> None:
    assert pause_after(clock, streamed, Topic.RUN, *more) == pytest.approx(pause)
