"""Schedules the drawing of changes: merges them, and draws streamed ones a few times a second."""

from __future__ import annotations

import time
from collections.abc import Callable

from flexgui.jobs.inbox import Inbox
from flexgui.session.scheduling import COMPUTE_TURNS
from flexgui.session.state import Topic

STREAMED = frozenset({Topic.RUN, Topic.DIAGNOSIS, Topic.STUDY, Topic.SCENARIO})
"""Topics that may wait a little: a job's events, and an edit, whose result is another topic."""
INTERVAL = 0.25
"""s between two drawings of streamed topics: a browser that always draws handles no click."""
SLOWEST = 1.0
"""s, the same after streaming for long: a browser without a graphics card must handle clicks."""
LONG = 5.0
"""s of streaming after which the pause is twice as long."""
QUIET_SECONDS = 0.4
"""s without a change until slow parts are drawn; a dragged slider pauses half as long."""


class RedrawScheduler:
    """Collects topics, calls `draw` with each once, and `draw_slow_parts` after a pause."""

    def __init__(
        self,
        draw: Callable[[frozenset[Topic]], None],
        draw_slow_parts: Callable[[], None],
        is_idle: Callable[[], bool],
    ) -> None:
        """`is_idle` returns whether no change is being computed."""
        self._draw, self._draw_slow_parts, self._is_idle = draw, draw_slow_parts, is_idle
        self._inbox = Inbox(self._paint, _together, self._pause)
        self.mark, self.close = self._inbox.put, self._inbox.close
        self._drawn = 0.0
        """Time of the last drawing, s (monotonic)."""
        self._streamed = 0.0
        """Time of the last drawing of streamed topics."""
        self._since = 0.0
        """Since when topics are streamed without a longer pause."""

    def _paint(self, dirty: list[Topic | None]) -> None:
        topics = frozenset(topic for topic in dirty if topic is not None)
        now = time.monotonic()
        if topics & STREAMED:
            self._since = now if now - self._streamed > 2.0 * SLOWEST else self._since
            self._streamed = now
        with COMPUTE_TURNS.for_drawing():
            if topics:
                self._draw(topics)
            elif self._is_idle():
                self._draw_slow_parts()
        if topics:
            self._drawn = time.monotonic()
            self._inbox.put(None)

    def _pause(self, dirty: list[Topic | None]) -> float:
        """s until the topics are to be drawn; `None` stands for the slow parts."""
        now = time.monotonic()
        if dirty == [None]:
            return self._drawn + QUIET_SECONDS - now
        if set(dirty) - STREAMED:
            return 0.0
        interval = INTERVAL
        if Topic.SCENARIO not in dirty:  # an edit waits no longer than at first
            streaming = self._streamed - self._since
            interval = min(INTERVAL * (1.0 + streaming / LONG), SLOWEST)
        return self._streamed + interval - now


def _together(dirty: list[Topic | None], topic: Topic | None) -> list[Topic | None]:
    """Adds a topic once; None is dropped while a topic waits."""
    if topic is None:
        return dirty or [None]
    return [*(each for each in dirty if each not in (None, topic)), topic]
