"""How a job stands: a sentence, a bar, and a button that stops it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flexgui.panels import widgets
from flexgui.panels.desk import Desk
from flexgui.panels.words import Words, paragraph
from flexgui.session.run import QUEUED, STOPPING


class Busy:
    """Seen while a job of one of `kinds` waits or runs."""

    def __init__(self, desk: Desk, *kinds: str) -> None:
        self._desk, self._kinds = desk, kinds
        self._said = Words(desk.gui)
        self._bar: Any = desk.gui.add_progress_bar(0.0, visible=False, animated=True)
        self._stop = widgets.button(desk, "Stop", desk.session.stop)
        self._stop.visible = False

    @property
    def running(self) -> bool:
        run = self._desk.session.run
        return run.busy and run.kind in self._kinds

    def refresh(self, else_said: Callable[[], str]) -> None:
        """`else_said` is what stands there while nothing runs."""
        running, run = self.running, self._desk.session.run
        self._bar.visible = running
        self._bar.value = 100.0 * (run.share if run.share is not None else 1.0)
        self._stop.visible = running and run.phase != STOPPING
        self._said.show(paragraph(self._sentence() if running else else_said(), "lead"))

    def _sentence(self) -> str:
        run = self._desk.session.run
        if run.phase == QUEUED:
            place = "" if run.place is None else f", place {run.place} in the queue"
            return f"Waiting{place}."
        if run.phase == STOPPING:
            return "Stopping …"
        steps = f" ({min(run.done, run.total)} of {run.total})" if run.total else ""
        text = f": {run.text}" if run.text else ""
        return f"{run.stage or 'Starting'}{steps}{text}"
