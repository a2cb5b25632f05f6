"""How a task in a worker speaks and listens: core's Progress over a pipe."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from flexgui.jobs.events import Advanced, NewGeneration, Partial, Stage
from flexgui.jobs.mailbox import Mailbox

if TYPE_CHECKING:
    from core.results import Generation


class Reporter:
    """Progress of one task. While it is paused, whoever calls it waits."""

    def __init__(self, mailbox: Mailbox, news: threading.Event) -> None:
        self._mailbox, self._news = mailbox, news
        self._run, self._stop = threading.Event(), threading.Event()
        self._run.set()
        self.noticed = False
        """Whether the task learnt that it should stop."""

    def stage(self, title: str, total: int | None = None) -> None:
        """A new stage begins."""
        self._report(Stage(title, total))

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps are done."""
        self._report(Advanced(n, text))

    def generation(self, fit_label: str, generation: Generation) -> None:
        """One generation is done."""
        self._report(NewGeneration(fit_label, generation))

    def partial(self, name: str, value: Any) -> None:
        """What the task has so far."""
        self._report(Partial(name, value))

    def stopped(self) -> bool:
        """Whether the task should end with the best it has."""
        self._run.wait()
        self.noticed = self.noticed or self._stop.is_set()
        return self._stop.is_set()

    def pause(self) -> None:
        """Hold the task at its next report."""
        self._run.clear()

    def resume(self) -> None:
        """Let the task go on."""
        self._run.set()

    def stop(self) -> None:
        """Also wakes a paused task."""
        self._stop.set()
        self._run.set()

    def _report(self, event: Stage | Advanced | NewGeneration | Partial) -> None:
        self._mailbox.put(event)
        self._news.set()
        self._run.wait()
