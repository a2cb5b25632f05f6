"""Turns of all sessions: one at a time, and an answer that is begun is ended first."""

from __future__ import annotations

import threading
import time

import pytest

from flexgui.session.latest import Turns

SOON = 5.0
"""s that a thread may take to be heard of."""


def waiting(turns: Turns, order: list[str], name: str, ends: bool) -> threading.Thread:
    """A thread that waits for its turn, and notes when it had it."""

    def run() -> None:
        with turns.end() if ends else turns.begin():
            order.append(name)

    def waits_or_had_it() -> bool:
        return name in order or len(turns._beginning) + len(turns._ending) > before

    before = len(turns._beginning) + len(turns._ending)
    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    limit = time.monotonic() + SOON
    while not waits_or_had_it() and time.monotonic() < limit:
        time.sleep(0.001)
    return thread


def test_who_ends_an_answer_goes_first_and_else_who_came_first() -> None:
    turns, order = Turns(), list[str]()
    with turns.begin():
        threads = [
            waiting(turns, order, "first", ends=False),
            waiting(turns, order, "second", ends=False),
            waiting(turns, order, "drawing", ends=True),
        ]
        assert order == []
    for thread in threads:
        thread.join(SOON)
    assert order == ["drawing", "first", "second"]


def test_a_turn_that_fails_is_handed_on() -> None:
    turns, order = Turns(), list[str]()
    with pytest.raises(ValueError, match="broken"), turns.end():
        raise ValueError("broken")
    waiting(turns, order, "next", ends=False).join(SOON)
    assert order == ["next"]
