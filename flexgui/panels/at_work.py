"""An effect at work on this arm: story, formula, the outputs with it and without it, and its torque
in the one that is missing."""

from __future__ import annotations

from flexgui.panels.candidates import story
from flexgui.panels.page_context import PageContext
from flexgui.panels.plot import Plot
from flexgui.panels.words import Words, joined, paragraph
from flexgui.views.demonstration import demonstration, demonstration_summary
from flexgui.views.missing_torque import missing_cloud

TORQUE = (
    "The joint torque that the model lacks in {}, over the joint's speed, and the law of the "
    "effect in it, with the opposite sign, as the torque that the motor has to deliver: where it "
    "passes through the middle of the dots, it explains them."
)
WAITING = "The arm is simulated with and without it …"


class AtWork:
    """Seen while an effect is demonstrated."""

    def __init__(self, desk: PageContext) -> None:
        self._desk = desk
        self._words, self._plot = Words(desk.gui), Plot(desk.gui, 0.56)
        self._below = Words(desk.gui)
        self._about, self._cloud = Words(desk.gui), Plot(desk.gui, 0.75)
        self._drawn: object = None
        self._torques: object = None

    def refresh(self) -> None:
        """Shows it, or why there is nothing to show."""
        session = self._desk.session
        shown = session.demonstration
        self._show_torque()
        if not session.demonstrated:
            self._words.show("")
            self._below.show("")
            self._plot.show(None)
            self._drawn = None
            return
        said = story(session.demonstrated)
        if shown is None:
            why = session.not_shown
            self._words.show(joined(said, paragraph(why or WAITING, "bad" if why else "soft")))
            self._below.show("")
            self._plot.show(None)
            self._drawn = None
            return
        self._words.show(said)
        self._below.show(paragraph(demonstration_summary(shown), "soft"))
        if shown is not self._drawn:
            self._drawn = shown
            self._plot.show(demonstration(shown))

    def _show_torque(self) -> None:
        """Only where a diagnosis knows what is missing and the effect has a law to put into it."""
        session = self._desk.session
        shown, torques = session.demonstration, session.torques_demonstrated
        if shown is None or not torques:
            self._torques = None
            self._about.show("")
            self._cloud.show(None)
        elif self._torques != (id(shown), id(torques)):
            self._torques = (id(shown), id(torques))
            where = f"recording {shown.recording}"
            self._about.show(paragraph(TORQUE.format(where), "soft"))
            self._cloud.show(missing_cloud(torques, shown.torques, shown.title))
