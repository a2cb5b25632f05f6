"""What a long computation reports while it goes on, from whichever thread."""

from __future__ import annotations

import threading

import pytest

from flexgui.core.processors import WORKERS, at_most
from flexgui.core.progress import (
    Progress,
    Silent,
    announce,
    beside,
    count_simulations,
    counted_simulations,
)


class Heard(Silent):
    """What was reported, in order."""

    def __init__(self) -> None:
        self.events: list[tuple[object, ...]] = []

    def stage(self, title: str, total: int | None = None) -> None:
        self.events.append((title, total))

    def advance(self, n: int = 1, text: str = "") -> None:
        self.events.append((n, text))

    def simulated(self, n: int) -> None:
        self.events.append((n,))


def test_simulations_are_reported_once_in_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, heard = [0.0], Heard()
    monkeypatch.setattr("time.monotonic", lambda: clock[0])
    with counted_simulations(heard, every=1.0):
        for clock[0] in (0.4, 0.8, 1.2, 1.6, 2.4):
            count_simulations(1)
    assert heard.events == [(3,), (2,)]


def test_what_cannot_be_counted_is_announced_to_who_listens() -> None:
    heard = Heard()
    announce("unheard")
    with counted_simulations(heard):
        announce("Compiling")
    assert heard.events == [(0, "Compiling")]


def test_work_beside_is_unseen_until_it_is_waited_for() -> None:
    heard, begun, waited_for = Heard(), threading.Event(), threading.Event()

    def work(progress: Progress) -> int:
        progress.stage("Checking", 3)
        progress.advance()
        begun.set()
        assert waited_for.wait(10.0)
        progress.advance(2, "both")
        return 7

    with beside(work, heard) as result:
        assert begun.wait(10.0) and not heard.events
        threading.Timer(0.1, waited_for.set).start()
        assert result() == 7
    assert heard.events == [("Checking", 3), (1, ""), (2, "both")]


@pytest.mark.skipif(WORKERS < 2, reason="one processor is no limit here")
def test_with_one_processor_work_beside_waits_until_it_is_asked_for() -> None:
    threads: list[int] = []
    with at_most(1), beside(lambda _: threads.append(threading.get_ident()), Silent()) as result:
        assert not threads
        result()
    assert threads == [threading.get_ident()]


def test_work_beside_that_nobody_waits_for_is_stopped() -> None:
    stopped = threading.Event()

    def work(progress: Progress) -> None:
        while not progress.stopped():
            threading.Event().wait(0.01)
        stopped.set()

    with beside(work, Silent()):
        pass
    assert stopped.is_set()
