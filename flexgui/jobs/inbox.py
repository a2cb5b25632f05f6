"""A queue for one receiver that merges waiting items, and the threads that deliver them.

Used for a job's events, for a slider's newest model and for the changes to draw.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

log = logging.getLogger(__name__)

IDLE_SECONDS = 3.0
"""s that an idle thread is kept: a dragged slider makes work every 0.1 s."""

Work = Callable[[], None]


class ThreadPool:
    """Starts a thread whenever all are busy: work that takes seconds delays no other work.

    Work must not raise.
    """

    def __init__(self, idle_seconds: float = IDLE_SECONDS) -> None:
        self._idle_seconds = idle_seconds
        self._changed = threading.Condition()
        self._work: deque[Work] = deque()
        self._idle = 0

    def run(self, work: Work) -> None:
        """Returns at once."""
        with self._changed:
            self._work.append(work)
            if self._idle >= len(self._work):
                self._changed.notify()
                return
        threading.Thread(target=self._serve, name="flexgui-pool", daemon=True).start()

    def _serve(self) -> None:
        while (work := self._next()) is not None:
            work()
            del work  # an idle thread must not keep a session alive

    def _next(self) -> Work | None:
        with self._changed:
            if not self._work:
                self._idle += 1
                self._changed.wait_for(lambda: self._work, self._idle_seconds)
                self._idle -= 1
            return self._work.popleft() if self._work else None


THREADS = ThreadPool()
"""The thread pool of this process."""


class Inbox:
    """Takes items from any thread; calls `deliver` with all waiting items on a thread of the pool,
    never twice at the same time."""

    def __init__(
        self,
        deliver: Callable[[list[Any]], object],
        merge: Callable[[list[Any], Any], list[Any]] = lambda waiting, item: [item],
        pause: Callable[[list[Any]], float] = lambda waiting: 0.0,
    ) -> None:
        """`merge` adds an item to the waiting ones, or else only the newest is kept; `pause`
        returns how many s they still wait."""
        self._deliver, self._merge, self._pause = deliver, merge, pause
        self._changed = threading.Condition()
        self._waiting: list[Any] = []
        self._busy = self._closed = False

    def put(self, item: Any) -> None:
        """Returns at once."""
        with self._changed:
            if self._closed:
                return
            self._waiting = self._merge(self._waiting, item)
            self._changed.notify_all()
            if self._busy:
                return
            self._busy = True
        THREADS.run(self._run)

    def close(self) -> None:
        """Delivers nothing more; a running delivery still ends."""
        with self._changed:
            self._closed, self._waiting = True, []
            self._changed.notify_all()

    def wait_idle(self, timeout: float) -> bool:
        """Whether all items are delivered within `timeout` s."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._busy, timeout)

    def _run(self) -> None:
        while items := self._next():
            try:
                self._deliver(items)
            except Exception:
                if not self._closed:  # after closing an error does not matter
                    log.exception("A delivery failed")

    def _next(self) -> list[Any]:
        with self._changed:
            while (pause := self._pause(self._waiting) if self._waiting else 0.0) > 0.0:
                self._changed.wait(pause)
            items, self._waiting = self._waiting, []
            if not items:
                self._busy = False
                self._changed.notify_all()
            return items
