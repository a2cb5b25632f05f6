"""An effect at work on this arm: its story, formula, outputs and torque; how its job stands."""

from __future__ import annotations

from flexgui.page.panel import PageContext
from flexgui.page.plot import Plot
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.stages.diagnose.panel_candidates import story
from flexgui.stages.diagnose.plots_demonstration import demonstration, demonstration_summary
from flexgui.views.missing_torque import missing_cloud

TORQUE = (
    "The joint torque that the model lacks in {}, over the joint's speed, and the law of the "
    "effect in it, with the opposite sign, as the torque that the motor has to deliver: where it "
    "passes through the middle of the dots, it explains them."
)
WAITING = "The arm is simulated with and without it …"


class AtWork:
    """Seen while an effect is demonstrated."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._words, self._plot = Words(context.gui), Plot(context.gui, 0.56)
        self._below = Words(context.gui)
        self._about, self._cloud = Words(context.gui), Plot(context.gui, 0.75)
        self._drawn: object = None
        self._torques: object = None

    def refresh(self) -> None:
        """Shows it, or why there is nothing to show."""
        session = self._context.session
        shown = session.demonstration.shown
        self._show_torque()
        if not session.demonstration.kind:
            self._words.show("")
            self._below.show("")
            self._plot.show(None)
            self._drawn = None
            return
        words = story(session.demonstration.kind)
        if shown is None:
            why = session.demonstration.not_shown
            self._words.show(joined(words, paragraph(why or WAITING, "bad" if why else "soft")))
            self._below.show("")
            self._plot.show(None)
            self._drawn = None
            return
        self._words.show(words)
        self._below.show(paragraph(demonstration_summary(shown), "soft"))
        if shown is not self._drawn:
            self._drawn = shown
            self._plot.show(demonstration(shown))

    def _show_torque(self) -> None:
        """Only where a diagnosis knows what is missing and the effect has a law to put into it."""
        session = self._context.session
        shown, torques = session.demonstration.shown, session.demonstration.torques
        if shown is None or not torques:
            self._torques = None
            self._about.show("")
            self._cloud.show(None)
        elif self._torques != (id(shown), id(torques)):
            self._torques = (id(shown), id(torques))
            where = f"recording {shown.recording}"
            self._about.show(paragraph(TORQUE.format(where), "soft"))
            self._cloud.show(missing_cloud(torques, shown.torques, shown.title))
