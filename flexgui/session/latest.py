"""Who computes when: only the newest value, and sessions in turn.

Python runs one thread at a time. Thirty sessions that take turns of some milliseconds are each
served sooner than thirty that are interrupted by one another all the time.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from flexgui.jobs.inbox import Inbox
from flexgui.session.state import Faults, Part


class LatestWins:
    """One wish at a time, on a thread of its own; a newer wish replaces one that waits."""

    def __init__(self, faults: Faults, part: Part) -> None:
        """A wish that fails leaves the part old."""
        self._faults, self._part = faults, part
        self._inbox = Inbox(self._grant)
        self.ask, self.close = self._inbox.put, self._inbox.close
        self.wait_idle = self._inbox.wait_idle

    def _grant(self, wishes: list[Callable[[], None]]) -> None:
        with self._faults.watch(self._part):
            wishes[-1]()


class Turns:
    """One at a time, in the order in which they asked; but whoever ends an answer goes before
    those who begin one, so that a move waits once and not before each of its halves.

    A turn lasts some milliseconds; never compile, read a file or wait for a browser in it.
    """

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._taken = False
        self._ending: deque[threading.Event] = deque()
        self._beginning: deque[threading.Event] = deque()

    @contextmanager
    def begin(self) -> Iterator[None]:
        """To compute what will be drawn."""
        with self._turn(self._beginning):
            yield

    @contextmanager
    def end(self) -> Iterator[None]:
        """To draw what is computed."""
        with self._turn(self._ending):
            yield

    @contextmanager
    def _turn(self, queue: deque[threading.Event]) -> Iterator[None]:
        mine = threading.Event()
        with self._guard:
            if self._taken:
                queue.append(mine)
            else:
                self._taken = True
                mine.set()
        mine.wait()
        try:
            yield
        finally:
            self._hand_on()

    def _hand_on(self) -> None:
        with self._guard:
            for queue in (self._ending, self._beginning):
                if queue:
                    queue.popleft().set()
                    return
            self._taken = False


TURNS = Turns()
"""Of all sessions of this server."""
