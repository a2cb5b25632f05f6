"""What waits for one receiver: newer news stand for older ones, and one delivery follows another.

Jobs tell their callbacks so, sliders their models, changes their drawings.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

log = logging.getLogger(__name__)

LINGER = 3.0
"""s that a thread waits for more work: a hand on a slider makes some every tenth of one."""

Work = Callable[[], None]


class Crew:
    """Never more work than threads: whoever compiles for seconds holds up nobody else.

    Work must not raise.
    """

    def __init__(self, linger: float = LINGER) -> None:
        self._linger = linger
        self._news = threading.Condition()
        self._work: deque[Work] = deque()
        self._idle = 0

    def run(self, work: Work) -> None:
        """Returns at once."""
        with self._news:
            self._work.append(work)
            if self._idle >= len(self._work):
                self._news.notify()
                return
        threading.Thread(target=self._serve, name="flexgui-crew", daemon=True).start()

    def _serve(self) -> None:
        while (work := self._next()) is not None:
            work()
            del work  # an idle thread keeps no session alive

    def _next(self) -> Work | None:
        with self._news:
            if not self._work:
                self._idle += 1
                self._news.wait_for(lambda: self._work, self._linger)
                self._idle -= 1
            return self._work.popleft() if self._work else None


CREW = Crew()
"""Of this process."""


def newest(waiting: list[Any], item: Any) -> list[Any]:
    """The newest wins."""
    return [item]


class Inbox:
    """Takes items from any thread; gives them to `deliver` on a thread of the crew, those that wait
    at once, and never two deliveries at a time."""

    def __init__(
        self,
        deliver: Callable[[list[Any]], object],
        merge: Callable[[list[Any], Any], list[Any]] = newest,
        pause: Callable[[list[Any]], float] = lambda waiting: 0.0,
    ) -> None:
        """`merge` puts an item to those that wait; `pause` says how many s they wait still."""
        self._deliver, self._merge, self._pause = deliver, merge, pause
        self._news = threading.Condition()
        self._waiting: list[Any] = []
        self._busy = self._closed = False

    def put(self, item: Any) -> None:
        """Returns at once."""
        with self._news:
            if self._closed:
                return
            self._waiting = self._merge(self._waiting, item)
            self._news.notify_all()
            if self._busy:
                return
            self._busy = True
        CREW.run(self._run)

    def close(self) -> None:
        """Nothing more is delivered; a delivery that is under way still ends."""
        with self._news:
            self._closed, self._waiting = True, []
            self._news.notify_all()

    def wait_idle(self, timeout: float) -> bool:
        """Whether all that was put in is delivered within `timeout` s."""
        with self._news:
            return self._news.wait_for(lambda: not self._busy, timeout)

    def _run(self) -> None:
        while items := self._next():
            try:
                self._deliver(items)
            except Exception:
                if not self._closed:  # nobody looks any more: failing is no fault
                    log.exception("What was delivered has failed")

    def _next(self) -> list[Any]:
        with self._news:
            while (pause := self._pause(self._waiting) if self._waiting else 0.0) > 0.0:
                self._news.wait(pause)
            items, self._waiting = self._waiting, []
            if not items:
                self._busy = False
                self._news.notify_all()
            return items
