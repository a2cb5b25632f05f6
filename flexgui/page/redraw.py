"""When what has changed is drawn: several changes as one, what streams a few times a second."""

from __future__ import annotations

import time
from collections.abc import Callable

from flexgui.jobs.inbox import Inbox
from flexgui.session.scheduling import CPU_LOCK
from flexgui.session.state import Topic

STREAMED = frozenset({Topic.RUN, Topic.DIAGNOSIS, Topic.STUDY, Topic.SCENARIO})
"""What may wait a little: a job's news, and an edit, whose result follows as another topic."""
INTERVAL = 0.25
"""s between two drawings of what streams: a browser that draws without a pause hears no click."""
SLOWEST = 1.0
"""s, the same of what has streamed for long: a search of minutes is not looked at four times each
second, and a browser without a graphics card has a moment for a click."""
LONG = 5.0
"""s of streaming after which the pause is twice as long."""
REST = 0.4
"""s without a change, twice what a hand on a slider pauses, until what takes long is drawn too."""


class RedrawScheduler:
    """Collects topics and gives them to `draw`, several changes of one kind as one; calls `settle`
    once they pause."""

    def __init__(
        self,
        draw: Callable[[frozenset[Topic]], None],
        draw_slow_parts: Callable[[], None],
        is_idle: Callable[[], bool],
    ) -> None:
        """`at_rest` says whether no change is being computed."""
        self._draw, self._draw_slow_parts, self._at_rest = draw, draw_slow_parts, is_idle
        self._inbox = Inbox(self._paint, _together, self._pause)
        self.mark, self.close = self._inbox.put, self._inbox.close
        self._drawn = 0.0
        """When something was drawn last."""
        self._streamed = 0.0
        """When what streams was drawn last."""
        self._since = 0.0
        """Since when it streams without a longer pause."""

    def _paint(self, dirty: list[Topic | None]) -> None:
        topics = frozenset(topic for topic in dirty if topic is not None)
        now = time.monotonic()
        if topics & STREAMED:
            self._since = now if now - self._streamed > 2.0 * SLOWEST else self._since
            self._streamed = now
        with CPU_LOCK.for_drawing():
            if topics:
                self._draw(topics)
            elif self._at_rest():
                self._draw_slow_parts()
        if topics:
            self._drawn = time.monotonic()
            self._inbox.put(None)

    def _pause(self, dirty: list[Topic | None]) -> float:
        """s until what has changed is to be drawn; `None` waits until changes pause."""
        now = time.monotonic()
        if dirty == [None]:
            return self._drawn + REST - now
        if set(dirty) - STREAMED:
            return 0.0
        interval = INTERVAL
        if Topic.SCENARIO not in dirty:  # an edit waits no longer than at first
            streaming = self._streamed - self._since
            interval = min(INTERVAL * (1.0 + streaming / LONG), SLOWEST)
        return self._streamed + interval - now


def _together(dirty: list[Topic | None], topic: Topic | None) -> list[Topic | None]:
    """Each topic once; nothing is at rest while one waits."""
    if topic is None:
        return dirty or [None]
    return [*(each for each in dirty if each not in (None, topic)), topic]
