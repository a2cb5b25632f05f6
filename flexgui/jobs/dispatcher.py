"""Callbacks in order on one thread, and messages merged where they come too fast."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from queue import SimpleQueue

from flexgui.jobs.events import Event

THREADS = 4
"""A callback that blocks takes one of them; a quarter of the page's news then still flows."""

log = logging.getLogger(__name__)


class Address:
    """One callback's queue: its events come in order and one at a time."""

    def __init__(self, dispatcher: Dispatcher, callback: Callable[[Event], None]) -> None:
        self._dispatcher, self._callback = dispatcher, callback
        self._mailbox = Mailbox()
        self._lock = threading.Lock()
        self._busy = False
        self._closed = False

    def post(self, event: Event) -> None:
        """Returns at once; the callback hears it soon."""
        with self._lock:
            self._mailbox.put(event)
            call, self._busy = not self._busy, True
        if call:
            self._dispatcher.call(self)

    def close(self) -> None:
        """The callback hears nothing more (a call that is under way still ends)."""
        self._closed = True

    def deliver(self) -> None:
        """Empties the mailbox; by the dispatcher."""
        while True:
            with self._lock:
                events = self._mailbox.take()
                if not events:
                    self._busy = False
                    return
            for event in events:
                self._call(event)

    def _call(self, event: Event) -> None:
        if self._closed:
            return
        try:
            self._callback(event)
        except Exception:
            log.exception("A callback failed on %s", type(event).__name__)


class Dispatcher:
    """A few daemon threads."""

    def __init__(self, threads: int = THREADS) -> None:
        self._calls: SimpleQueue[Address | None] = SimpleQueue()
        self._threads = [
            threading.Thread(target=self._run, name=f"jobs-dispatcher-{k}", daemon=True)
            for k in range(threads)
        ]
        for thread in self._threads:
            thread.start()

    def call(self, address: Address) -> None:
        """Empty a queue soon, on one of the threads."""
        self._calls.put(address)

    def close(self, timeout: float) -> None:
        """Delivers what was posted before, then ends; a callback that blocks is left behind."""
        for _ in self._threads:
            self._calls.put(None)
        each = timeout / len(self._threads)
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(each)

    def _run(self) -> None:
        while (address := self._calls.get()) is not None:
            address.deliver()


class Mailbox:
    """Takes events from any thread; gives them all at once.

    An event is merged into a waiting one of the same subject, but never across one that has no
    subject (a new stage, an end): so the order of what matters stays, and what waits is short
    however slow the reader is.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: list[Event] = []

    def put(self, event: Event) -> None:
        """Add an event, or merge it with one of its kind that waits."""
        with self._lock:
            place = self._mergeable(event)
            if place is None:
                self._waiting.append(event)
            else:
                self._waiting[place] = event.after(self._waiting[place])

    def take(self) -> list[Event]:
        """All that waited."""
        with self._lock:
            taken, self._waiting = self._waiting, []
        return taken

    def _mergeable(self, event: Event) -> int | None:
        if event.subject is None:
            return None
        for place in reversed(range(len(self._waiting))):
            subject = self._waiting[place].subject
            if subject is None:
                return None
            if subject == event.subject:
                return place
        return None
