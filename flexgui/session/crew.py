"""Threads that all sessions share: as many as work at the moment, and soon none."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

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
"""Of all sessions of this server."""
