"""When what has changed is drawn: several changes as one, what streams a few times a second."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from flexgui.session import Topic
from flexgui.session.latest import CREW, TURNS

log = logging.getLogger(__name__)


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


class Painter:
    """Collects topics and gives them to `draw`, several changes of one kind as one; calls `settle`
    once they pause."""

    def __init__(
        self,
        draw: Callable[[frozenset[Topic]], None],
        settle: Callable[[], None],
        at_rest: Callable[[], bool],
    ) -> None:
        """`at_rest` says whether no change is being computed."""
        self._draw, self._settle, self._at_rest = draw, settle, at_rest
        self._news = threading.Condition()
        self._dirty: set[Topic] = set()
        self._busy = self._closed = False
        self._streamed = 0.0
        """When what streams was drawn last."""
        self._since = 0.0
        """Since when it streams without a longer pause."""

    def mark(self, topic: Topic) -> None:
        """Returns at once."""
        with self._news:
            if self._closed:
                return
            self._dirty.add(topic)
            self._news.notify()
            if self._busy:
                return
            self._busy = True
        CREW.run(self._run)

    def close(self) -> None:
        """Draws nothing more."""
        with self._news:
            self._closed = True
            self._news.notify()

    def _run(self) -> None:
        unsettled = False
        while (dirty := self._next(unsettled)) is not None:
            if dirty & STREAMED:
                self._note_streamed(time.monotonic())
            try:
                with TURNS.end():
                    if dirty:
                        self._draw(dirty)
                    else:
                        self._settle()
            except Exception:
                if not self._closed:
                    log.exception("Drawing %s failed", sorted(topic.value for topic in dirty))
            unsettled = bool(dirty)

    def _next(self, unsettled: bool) -> frozenset[Topic] | None:
        """What is to be drawn, when it is time; empty where changes pause, None where nothing is
        to be done."""
        with self._news:
            if unsettled:
                self._news.wait_for(lambda: self._closed or self._dirty, REST)
                unsettled = self._at_rest()
            while not self._closed and (pause := self._pause()):
                self._news.wait(pause)
            dirty, self._dirty = frozenset(() if self._closed else self._dirty), set()
            self._busy = bool(dirty) or (unsettled and not self._closed)
            return dirty if self._busy else None

    def _note_streamed(self, now: float) -> None:
        if now - self._streamed > 2.0 * SLOWEST:
            self._since = now
        self._streamed = now

    def _pause(self) -> float:
        """s until what has changed is to be drawn."""
        if not self._dirty or self._dirty - STREAMED:
            return 0.0
        interval = INTERVAL
        if Topic.SCENARIO not in self._dirty:  # an edit waits no longer than at first
            streaming = self._streamed - self._since
            interval = min(INTERVAL * (1.0 + streaming / LONG), SLOWEST)
        return max(self._streamed + interval - time.monotonic(), 0.0)
