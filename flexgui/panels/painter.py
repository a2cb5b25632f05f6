"""Draws what changed on another thread, so that no callback ever waits for a drawing."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from flexgui.session import Topic
from flexgui.session.crew import CREW
from flexgui.session.turn import TURNS

log = logging.getLogger(__name__)


STREAMED = frozenset({Topic.RUN, Topic.DIAGNOSIS, Topic.STUDY})
INTERVAL = 0.25
"""s between two drawings of what streams: a browser that draws without a pause hears no click."""


class Painter:
    """Collects topics and gives them to `draw`, several changes of one kind as one."""

    def __init__(self, draw: Callable[[frozenset[Topic]], None]) -> None:
        self._draw = draw
        self._news = threading.Condition()
        self._dirty: set[Topic] = set()
        self._busy = self._closed = False
        self._streamed = 0.0
        """When what streams was drawn last."""

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
        while dirty := self._next():
            if dirty & STREAMED:
                self._streamed = time.monotonic()
            try:
                with TURNS.end():
                    self._draw(dirty)
            except Exception:
                if not self._closed:
                    log.exception("Drawing %s failed", sorted(topic.value for topic in dirty))

    def _next(self) -> frozenset[Topic]:
        """What is to be drawn, when it is time; empty where nothing is."""
        with self._news:
            while not self._closed and (pause := self._pause()):
                self._news.wait(pause)
            dirty, self._dirty = frozenset(() if self._closed else self._dirty), set()
            self._busy = bool(dirty)
            return dirty

    def _pause(self) -> float:
        """s until what has changed is to be drawn."""
        if not self._dirty or self._dirty - STREAMED:
            return 0.0
        return max(self._streamed + INTERVAL - time.monotonic(), 0.0)
