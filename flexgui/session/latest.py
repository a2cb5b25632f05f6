"""Who computes when: only the newest value, sessions in turn, one drawing at a time.

Python runs one thread at a time. Thirty sessions that take turns of some milliseconds are each
served sooner than thirty that are interrupted by one another all the time.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from flexgui.session.state import Faults, Part


class LatestWins:
    """One wish at a time, on a thread of the crew; a newer wish replaces one that waits."""

    def __init__(self, faults: Faults, part: Part) -> None:
        """A wish that fails leaves the part old."""
        self._faults, self._part = faults, part
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
            with self._faults.watch(self._part):
                wish()

    def _next(self) -> Callable[[], None] | None:
        with self._news:
            wish, self._wish = self._wish, None
            if wish is None:
                self._busy = False
                self._news.notify_all()
            return wish


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
