"""A worker that only cares for the newest wish."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

log = logging.getLogger(__name__)


class LatestWins:
    """One daemon thread, started by the first wish; a newer wish replaces one that waits."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._news = threading.Condition()
        self._wish: Callable[[], None] | None = None
        self._thread: threading.Thread | None = None
        self._closed = False
        self._busy = False

    def ask(self, wish: Callable[[], None]) -> None:
        """Returns at once."""
        with self._news:
            if self._closed:
                return
            self._wish = wish
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
                self._thread.start()
            self._news.notify_all()

    def close(self) -> None:
        """Nothing more is begun."""
        with self._news:
            self._closed, self._wish = True, None
            self._news.notify_all()

    def wait_idle(self, timeout: float) -> bool:
        """Whether all that was asked for is done within `timeout` s; for tests and scripts."""
        with self._news:
            return self._news.wait_for(lambda: self._wish is None and not self._busy, timeout)

    def _run(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._wish is not None or self._closed)
                if self._closed:
                    return
                wish, self._wish, self._busy = self._wish, None, True
            try:
                assert wish is not None
                wish()
            except Exception:
                log.exception("A wish of %s failed", self._name)
            with self._news:
                self._busy = False
                self._news.notify_all()
