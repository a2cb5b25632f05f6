"""A worker that only cares for the newest wish."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from flexgui.session.crew import CREW

log = logging.getLogger(__name__)


class LatestWins:
    """One wish at a time, on a thread of the crew; a newer wish replaces one that waits."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._news = threading.Condition()
        self._wish: Callable[[], None] | None = None
        self._closed = False
        self._busy = False

    def ask(self, wish: Callable[[], None]) -> None:
        """Returns at once."""
        with self._news:
            if self._closed:
                return
            self._wish = wish
            if self._busy:
                return
            self._busy = True
        CREW.run(self._run)

    def close(self) -> None:
        """Nothing more is begun."""
        with self._news:
            self._closed, self._wish = True, None

    def wait_idle(self, timeout: float) -> bool:
        """Whether all that was asked for is done within `timeout` s; for tests and scripts."""
        with self._news:
            return self._news.wait_for(lambda: not self._busy, timeout)

    def _run(self) -> None:
        while (wish := self._next()) is not None:
            try:
                wish()
            except Exception:
                log.exception("A request of %s failed", self._name)

    def _next(self) -> Callable[[], None] | None:
        with self._news:
            wish, self._wish = self._wish, None
            if wish is None:
                self._busy = False
                self._news.notify_all()
            return wish
