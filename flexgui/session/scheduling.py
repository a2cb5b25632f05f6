"""When a session computes: only the newest request, and one session at a time.

Python runs one thread at a time. Thirty sessions that compute one after another, some milliseconds
each, all answer sooner than thirty that interrupt one another.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from flexgui.jobs.inbox import Inbox
from flexgui.session.state import Faults, PagePart


class LatestRequest:
    """Runs one request at a time on another thread; a newer request replaces a waiting one."""

    def __init__(self, faults: Faults, part: PagePart) -> None:
        """`part` of the page is marked as outdated after a request that fails."""
        self._faults, self._part = faults, part
        self._inbox = Inbox(self._run)
        self.request, self.close = self._inbox.put, self._inbox.close
        self.wait_idle = self._inbox.wait_idle

    def _run(self, requests: list[Callable[[], None]]) -> None:
        with self._faults.watch(self._part):
            requests[-1]()


class ComputeTurns:
    """A lock that lets one session at a time compute, in order of arrival. Drawing goes before
    computing: a slider's move is computed, then drawn, and waits only once.

    Hold it for milliseconds; never compile, read a file or wait for a browser under it.
    """

    def __init__(self) -> None:
        self._state_lock = threading.Lock()
        self._held = False
        self._drawing: deque[threading.Event] = deque()
        self._computing: deque[threading.Event] = deque()

    def for_computing(self) -> AbstractContextManager[None]:
        """To compute what will be drawn."""
        return self._turn(self._computing)

    def for_drawing(self) -> AbstractContextManager[None]:
        """To draw what is computed."""
        return self._turn(self._drawing)

    @contextmanager
    def _turn(self, queue: deque[threading.Event]) -> Iterator[None]:
        my_turn = threading.Event()
        with self._state_lock:
            if self._held:
                queue.append(my_turn)
            else:
                self._held = True
                my_turn.set()
        my_turn.wait()
        try:
            yield
        finally:
            self._pass_on()

    def _pass_on(self) -> None:
        with self._state_lock:
            for queue in (self._drawing, self._computing):
                if queue:
                    queue.popleft().set()
                    return
            self._held = False


COMPUTE_TURNS = ComputeTurns()
"""Shared by all sessions of this server."""
