"""Events on their way: in order, and merged where only the newest counts."""

from __future__ import annotations

import threading

from flexgui.jobs.events import Event


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
