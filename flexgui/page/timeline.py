"""The time-line at the bottom: one cursor for the arm, its ghost and the plots."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from markupsafe import Markup

from flexgui.page.layout import LINE_MARGIN, Widths, Window
from flexgui.page.panel import PageContext, Piece
from flexgui.page.scene_panel import COLOURED, legend, plays
from flexgui.page.widgets import Words, choice, paragraph, slider
from flexgui.scene.paint import DIRECTIONS
from flexgui.views.error_map import words as error_words

SPEEDS = {f"speed ×{speed:g}": speed for speed in (0.1, 0.25, 0.5, 1.0, 2.0)}
ERRORS = {f"error ×{times:g}": times for times in (1.0, 5.0, 20.0, 100.0)}
"""How many times larger the distance of the measured arm from the model is drawn: two arms that lie
on each other are seen apart."""
ROW = Markup("<span class='fx-line'></span>")
"""A mark for the style sheet: the inputs below stand beside one another."""
POSTURE = "Here the sliders set the posture; recordings play from Data on."
UNREAD = "The recording is not read yet; it will play here."
NOTHING = "Here a recording will play, once there is one."
STEP = 0.02
"""s, one frame."""
MOVES = {
    "◀ step": (False, -STEP),
    "Play": (True, 0.0),
    "Pause": (False, 0.0),
    "step ▶": (False, STEP),
}
"""Button -> whether it plays then, and how many s the cursor jumps."""


class TimeLine(Piece):
    """Play, pause, step, seek, speed."""

    def __init__(self, context: PageContext, look_from: Callable[[str], None]) -> None:
        """`look_from` turns the view of the arm to one of DIRECTIONS."""
        super().__init__(context)
        gui, playback = self.gui, self.session.playback
        self._panel = gui.add_panel()
        with self._panel.add_tab("Time-line"):
            self._about = Words(gui, ROW)
            self._seek = slider(
                context, "Time [s]", (0.0, 10.0, 0.01), lambda: playback.cursor.time,
                lambda time: playback.move(time=time, playing=False),
            )  # fmt: skip
            moves = gui.add_button_group("Move", tuple(MOVES))
            choice(
                context, "Speed", tuple(SPEEDS), lambda: _named(SPEEDS, playback.cursor.speed),
                lambda name: playback.move(speed=SPEEDS[name]),
            )  # fmt: skip
            choice(
                context, "Error drawn", tuple(ERRORS),
                lambda: _named(ERRORS, playback.cursor.error),
                lambda name: playback.move(error=ERRORS[name]),
                "Draws the measured arm farther from the model.",
            )  # fmt: skip
            views = gui.add_button_group("View", tuple(DIRECTIONS))
            views.on_click(lambda _: look_from(str(views.value)))
        self._size = (0.0, 0.0)
        if not context.read_only:
            moves.on_click(lambda _: self._pressed(str(moves.value)))

    def fit(self, window: Window, shares: Widths) -> None:
        """Into the picture of the arm; where a person has put it, it stays."""
        size = (shares.line, shares.line_height)
        if not any(self._size):
            self._panel.float(x=LINE_MARGIN, y=-LINE_MARGIN, width=size[0], height=size[1])
        elif size != self._size:
            self._panel.set_width(size[0])
            self._panel.set_height(size[1])
        self._size = size

    def refresh(self) -> None:
        """Shows the cursor."""
        motion, cursor = self.session.playback.motion, self.session.playback.cursor
        if motion is None or not plays(self.session):
            none = UNREAD if self.session.document.scenario.recordings else NOTHING
            self._about.show(ROW, paragraph(none if motion is None else POSTURE, "soft"))
            return
        who = "identified model" if motion.fitted else "model as stated"
        pace = "" if cursor.speed == 1.0 else f", speed ×{cursor.speed:g}"
        now = f"{motion.recording}: {who}{pace}{self._error()}"
        self._about.show(ROW, paragraph(now), paragraph(legend(self.session), "soft"))
        # A value beyond a greatest one of more digits would be shown as that, with all of them.
        self._seek.max = last_time(motion.seconds)
        self._seek.value = min(round(cursor.time, 2), self._seek.max)

    def _error(self) -> str:
        """What the arm's colours say, in words."""
        session, cursor = self.session, self.session.playback.cursor
        found = session.comparison.failing if session.stage in COLOURED else None
        along = None if found is None else found.now.get(cursor.recording)
        return "" if along is None else f"; {error_words(along.at(cursor.time), along.units)}"

    def _pressed(self, label: str) -> None:
        playing, jump = MOVES[label]
        self.session.playback.move(playing=playing)
        if jump:
            self.session.playback.advance(jump)


def last_time(seconds: float) -> float:
    """The last time that the box of a recording of so many seconds shows, of two decimals."""
    return math.floor(100.0 * seconds + 1e-6) / 100.0


def _named(options: Mapping[str, float], value: float) -> str:
    """The option nearest to a value."""
    return min(options, key=lambda name: abs(options[name] - value))
