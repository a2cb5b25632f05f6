"""How the running job stands, above its stage, with the button that stops it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from markupsafe import Markup

from flexgui.core.diagnose.announce import aside
from flexgui.jobs.job import QUEUED, STOPPING, JobState
from flexgui.page import widgets
from flexgui.page.panel import PageContext
from flexgui.page.widgets import Words, paragraph


class Busy:
    """Seen while a job of one of `kinds` waits or runs."""

    def __init__(self, context: PageContext, *kinds: str) -> None:
        self._context, self._kinds = context, kinds
        self._status = Words(context.gui)
        self._bar: Any = context.gui.add_progress_bar(0.0, visible=False, animated=True)
        self._stop = widgets.button(context, "Stop", context.session.run.stop)
        self._stop.visible = False
        self._aside = Words(context.gui)

    @property
    def running(self) -> bool:
        """Whether a job of these kinds waits or runs."""
        run = self._context.session.run.state
        return run.busy and run.kind in self._kinds

    def refresh(self, otherwise: Callable[[], str]) -> None:
        """`else_said` is what stands there while nothing runs."""
        running, run = self.running, self._context.session.run.state
        self._bar.visible = running
        self._bar.value = 100.0 * (run.share if run.share is not None else 1.0)
        self._stop.visible = running
        self._stop.disabled = run.phase == STOPPING or self._context.read_only
        head, tail, note = how_it_stands(run)
        now = Markup("<p class='lead fx-busy'>{}<span>{}</span></p>").format(head, tail)
        self._status.show(now if running else paragraph(otherwise(), "lead"))
        self._aside.show(paragraph(note, "soft") if running and note else "")


def how_it_stands(run: JobState) -> tuple[str, str, str]:
    """The stage and how far it is; what it is at; and what is said in a lower voice."""
    if run.phase == QUEUED:
        place = "" if run.place is None else f", place {run.place} in the queue"
        return f"Waiting{place}.", "", ""
    if run.phase == STOPPING:
        return "Stopping …", "", ""
    activity, note = aside(run.text)
    steps = f", {min(run.done, run.total)} of {run.total}" if run.total else ""
    note = note.strip("()")
    lower = note[:1].upper() + note[1:]
    return f"{run.stage or 'Starting'}{steps}", f": {activity}" if activity else "", lower
