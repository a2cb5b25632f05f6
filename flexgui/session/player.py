"""Moves the time-line's cursor while it plays."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexgui.session.playing import Playing

RATE = 25.0
"""Frames a second; the page draws arm and cursor at each."""


class Player:
    """A thread that lives only while something plays."""

    def __init__(self, session: Playing) -> None:
        self._session = session
        self._lock = threading.Lock()
        self._running = False

    def wake(self) -> None:
        """Starts to move the cursor where it should and nobody does yet."""
        with self._lock:
            if self._running or not self._session.cursor.playing:
                return
            self._running = True
        threading.Thread(target=self._run, name="player", daemon=True).start()

    def _run(self) -> None:
        last = time.monotonic()
        while True:
            time.sleep(1.0 / RATE)
            now = time.monotonic()
            with self._lock:
                cursor = self._session.cursor
                if not cursor.playing or self._session.closed:
                    self._running = False
                    return
            self._session.advance((now - last) * cursor.speed)
            last = now
