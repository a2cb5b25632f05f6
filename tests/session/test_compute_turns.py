"""Turns of all sessions: one at a time, and an answer that is begun is ended first."""

from __future__ import annotations

import threading
import time

import pytest

from flexgui.session.scheduling import ComputeTurns

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
