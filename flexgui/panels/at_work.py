"""An effect at work on this arm: story, formula, and the arm with it against the arm without."""

from __future__ import annotations

from flexgui.panels.candidates import story
from flexgui.panels.desk import Desk
from flexgui.panels.plot import Plot
from flexgui.panels.words import Words, joined, paragraph
from flexgui.views.demonstration import demonstration, told

WAITING = "The arm is simulated with and without it …"


class AtWork:
    """Seen while an effect is demonstrated."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._words, self._plot = Words(desk.gui), Plot(desk.gui, 0.56)
        self._below = Words(desk.gui)
        self._drawn: object = None

    def refresh(self) -> None:
        """Shows it, or why there is nothing to show."""
        session = self._desk.session
        shown = session.demonstration
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
        self._below.show(paragraph(told(shown), "soft"))
        if shown is not self._drawn:
            self._drawn = shown
            self._plot.show(demonstration(shown))
