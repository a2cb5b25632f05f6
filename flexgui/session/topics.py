"""What of a session can change, and how its subscribers learn of it: they hear the topic and read
the session."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from enum import Enum

from core.sentences import brief
from flexgui.session.state import Message


class Topic(Enum):
    """One part of a session's state."""

    SCENARIO = "scenario"
    LIVE = "live"
    """The model of the sliders was computed anew."""
    STAGE = "stage"
    """Another stage of the work is shown."""
    RECORDINGS = "recordings"
    RUN = "run"
    OUTCOME = "outcome"
    DIAGNOSIS = "diagnosis"
    """What could be missing, and what was added."""
    DEMONSTRATION = "demonstration"
    """What one effect would do."""
    CHALLENGE = "challenge"
    STUDY = "study"
    """The Monte Carlo study: its settings, how it stands, what it has found."""
    TOUR = "tour"
    KEPT = "kept"
    """Earlier work is offered, or no longer."""
    CURSOR = "cursor"
    MESSAGE = "message"


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
