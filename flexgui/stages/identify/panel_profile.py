"""On Identify: the profile likelihood of a parameter, computed on demand."""

from __future__ import annotations

from flexgui.core.results import Outcome
from flexgui.page.job_status import JobStatus
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.plot import Plot
from flexgui.page.widgets import HtmlBlock, button, choice, paragraph, set_options
from flexgui.views.names import is_of_a_start
from flexgui.views.profile import interval_sentence, profile

ABOUT = (
    "Holds one parameter beside its estimate and fits the others again: an interval that need not "
    "be symmetric."
)


class ProfileChoice(PageElement):
    """Which parameter, and the button; hidden without a result."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._known: dict[str, tuple[str, str | None]] = {}
        self._chosen = ""
        self._folder = self.gui.add_folder("Interval of a parameter", expand_by_default=False)
        with self._folder:
            HtmlBlock(self.gui, paragraph(ABOUT, "soft"))
            self._choice = choice(context, "Parameter", ("",), lambda: self._chosen, self._choose)
            self._button = button(context, "Compute its profile", self._start)
            self._status = JobStatus(context, "profile")

    def refresh(self) -> None:
        """As the last result stands."""
        outcome = self.session.identification.outcome
        self._known = {} if outcome is None else _parameters(outcome)
        self._folder.visible = bool(self._known)
        if self._known:
            set_options(self._choice, tuple(self._known), self._chosen)
            self._chosen = self._choice.value
        self.enable(not self.session.run.busy, self._button)
        self._status.refresh("")

    def _choose(self, text: str) -> bool:
        self._chosen = text
        return True

    def _start(self) -> None:
        if self._chosen in self._known:
            self.session.identification.find_profile(*self._known[self._chosen])


class ProfileFigure(PageElement):
    """The profile that was computed last."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words, self._plot = HtmlBlock(self.gui), Plot(context, 0.75)

    def refresh(self) -> None:
        """As the last result stands."""
        found = self.session.identification.profile
        self._words.show("" if found is None else paragraph(interval_sentence(found), "lead"))
        self._plot.show_whole(None if found is None else profile(found))


def _parameters(outcome: Outcome) -> dict[str, tuple[str, str | None]]:
    """Words -> parameter, and the recording that was fitted alone, if each was."""
    alone = len(outcome.fits) > 1
    return {
        f"{e.label}, {fit.label}" if alone else e.label: (e.label, fit.label if alone else None)
        for fit in outcome.fits
        for e in fit.estimates
        if not is_of_a_start(e)
    }
