"""One thread per page that draws what changed, so that no callback ever waits for a drawing."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from flexgui.session import Topic

log = logging.getLogger(__name__)


class Painter:
    """Collects topics and gives them to `draw`, several changes of one kind as one."""

    def __init__(self, draw: Callable[[frozenset[Topic]], None]) -> None:
        self._draw = draw
        self._news = threading.Condition()
        self._dirty: set[Topic] = set()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="painter", daemon=True)
        self._thread.start()

    def mark(self, topic: Topic) -> None:
        """Returns at once."""
        with self._news:
            self._dirty.add(topic)
            self._news.notify()

    def close(self) -> None:
        """Draws nothing more."""
        with self._news:
            self._closed = True
            self._news.notify()

    def _run(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: bool(self._dirty) or self._closed)
                if self._closed:
                    return
                dirty, self._dirty = frozenset(self._dirty), set()
            try:
                self._draw(dirty)
            except Exception:
                if not self._closed:
                    log.exception("Drawing %s failed", sorted(topic.value for topic in dirty))
