"""Something that notifies its subscribers which part of it changed."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from core.sentences import brief
from flexgui.session.state import Message
from flexgui.session.topics import Topic

Subscriber = Callable[[Topic], None]
log = logging.getLogger(__name__)


class Observable:
    """Subscribers, and the sentence that the person reads."""

    def __init__(self) -> None:
        self.message = Message("")
        self._lock = threading.RLock()
        self._subscribers: list[Subscriber] = []

    def subscribe(self, callback: Subscriber) -> Callable[[], None]:
        """Calls back with each topic that changes, from any thread; returns how to end that."""
        with self._lock:
            self._subscribers.append(callback)

        def end() -> None:
            with self._lock:
                if callback in self._subscribers:
                    self._subscribers.remove(callback)

        return end

    def notify(self, *topics: Topic) -> None:
        """Lets the subscribers know."""
        with self._lock:
            subscribers = tuple(self._subscribers)
        for topic in topics:
            for subscriber in subscribers:
                try:
                    subscriber(topic)
                except Exception:
                    log.exception("A subscriber failed on %s", topic)

    def show_message(self, text: str, bad: bool = False) -> None:
        """A sentence for the person."""
        with self._lock:
            self.message = Message(brief(text) if bad else text, bad, self.message.number + 1)
        self.notify(Topic.MESSAGE)
