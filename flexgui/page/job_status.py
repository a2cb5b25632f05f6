"""The progress of the running job, above its stage, with the button that stops it."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from flexgui.core.diagnose.progress_messages import split_note
from flexgui.jobs.job import QUEUED, STOPPING, JobState
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, button, paragraph


class JobStatus(PageElement):
    """Shown while a job of one of `kinds` waits or runs."""

    def __init__(self, context: PageContext, *kinds: str) -> None:
        super().__init__(context)
        self._kinds = kinds
        self._status = HtmlBlock(self.gui)
        self._bar: Any = self.gui.add_progress_bar(0.0, visible=False, animated=True)
        self._stop = button(context, "Stop", self.session.run.stop)
        self._stop.visible = False
        self._aside = HtmlBlock(self.gui)

    @property
    def running(self) -> bool:
        """Whether a job of these kinds waits or runs."""
        run = self.session.run.state
        return run.busy and run.kind in self._kinds

    def refresh(self, otherwise: str) -> None:
        """`otherwise` is the text while no job runs."""
        running, run = self.running, self.session.run.state
        self._bar.visible = self._stop.visible = running
        self._bar.value = 100.0 * (run.share if run.share is not None else 1.0)
        self.enable(run.phase != STOPPING, self._stop)
        head, tail, note = status_texts(run)
        now = Markup("<p class='lead fx-busy'>{}<span>{}</span></p>").format(head, tail)
        self._status.show(now if running else paragraph(otherwise, "lead"))
        self._aside.show(paragraph(note, "soft") if running else "")


def waiting(run: JobState) -> str:
    """Why a job of the queue does not run yet."""
    if run.place == 0:
        return "A worker process is being started."
    return "Waiting." if run.place is None else f"Waiting, place {run.place} in the queue."


def status_texts(run: JobState) -> tuple[str, str, str]:
    """The stage and its progress, the present activity, and a note in small print: how many
    simulations it took so far, which moves while a step takes long, and what must be compiled."""
    if run.phase == QUEUED:
        return waiting(run), "", ""
    if run.phase == STOPPING:
        return "Stopping …", "", ""
    activity, note = split_note(run.text)
    steps = f", {min(run.done, run.total)} of {run.total}" if run.total else ""
    count = f"{run.simulations:,} simulations" if run.simulations else ""
    lower = ", ".join(filter(None, (count, note.strip("()"))))
    small = lower[:1].upper() + lower[1:]
    return f"{run.stage or 'Starting'}{steps}", f": {activity}" if activity else "", small
