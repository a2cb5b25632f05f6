"""The time-line at the bottom: one cursor for the arm, its ghost and the plots."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from markupsafe import Markup

from flexgui.page import widgets
from flexgui.page.layout import LINE_MARGIN, Widths, Window
from flexgui.page.panel import PageContext
from flexgui.page.recording_in_scene import COLOURED, legend, plays
from flexgui.page.widgets import Words, joined, paragraph
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


class TimeLine:
    """Play, pause, step, seek, speed."""

    def __init__(self, context: PageContext, look_from: Callable[[str], None]) -> None:
        """`look_from` turns the view of the arm to one of DIRECTIONS."""
        self._context, playback = context, context.session.playback
        gui = context.gui
        self._panel = gui.add_panel()
        with self._panel.add_tab("Time-line"):
            self._about = Words(gui, ROW)
            self._seek = widgets.slider(
                context,
                "Time [s]",
                (0.0, 10.0, 0.01),
                lambda: playback.cursor.time,
                self._to,
            )
            self._buttons = gui.add_button_group("Move", ("◀ step", "Play", "Pause", "step ▶"))
            widgets.choice(
                context, "Speed", tuple(SPEEDS), lambda: _named(SPEEDS, playback.cursor.speed),
                lambda v: playback.move(speed=SPEEDS[v]),
            )  # fmt: skip
            widgets.choice(
                context, "Error drawn", tuple(ERRORS),
                lambda: _named(ERRORS, playback.cursor.error),
                lambda v: playback.move(error=ERRORS[v]),
                "Draws the measured arm farther from the model.",
            )  # fmt: skip
            views = gui.add_button_group("View", tuple(DIRECTIONS))
            views.on_click(lambda _: look_from(str(views.value)))
        self._size = (0.0, 0.0)
        if not context.read_only:
            self._buttons.on_click(lambda _: self._pressed(str(self._buttons.value)))

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
        session = self._context.session
        motion, cursor = session.playback.motion, session.playback.cursor
        if motion is None or not plays(session):
            none = UNREAD if session.document.scenario.recordings else NOTHING
            words = none if motion is None else POSTURE
            self._about.show(ROW + paragraph(words, "soft"))
            return
        who = "identified model" if motion.fitted else "model as stated"
        pace = "" if cursor.speed == 1.0 else f", speed ×{cursor.speed:g}"
        now = f"{motion.recording}: {who}{pace}{self._error()}"
        what = legend(session)
        soft = paragraph(what, "soft") if what else ""
        self._about.show(joined(ROW, paragraph(now), soft))
        # A value beyond a greatest one of more digits would be shown as that, with all of them.
        most = last_time(motion.seconds)
        if self._seek.max != most:
            self._seek.max = most
        shown = min(round(cursor.time, 2), most)
        if abs(self._seek.value - shown) > 1e-9:
            self._seek.value = shown

    def _error(self) -> str:
        """What the arm's colours say, in words."""
        session = self._context.session
        found = session.comparison.failing if session.stage in COLOURED else None
        along = None if found is None else found.now.get(session.playback.cursor.recording)
        if along is None:
            return ""
        return f"; {error_words(along.at(session.playback.cursor.time), along.units)}"

    def _to(self, time: float) -> None:
        self._context.session.playback.move(time=time, playing=False)

    def _pressed(self, what: str) -> None:
        session = self._context.session
        actions = {
            "Play": lambda: session.playback.move(playing=True),
            "Pause": lambda: session.playback.move(playing=False),
            "◀ step": lambda: self._step(-STEP),
            "step ▶": lambda: self._step(STEP),
        }
        actions[what]()

    def _step(self, by: float) -> None:
        session = self._context.session
        session.playback.move(playing=False)
        session.playback.advance(by)


def last_time(seconds: float) -> float:
    """The last time that the box of a recording of so many seconds shows, of two decimals."""
    return math.floor(100.0 * seconds + 1e-6) / 100.0


def _named(options: Mapping[str, float], value: float) -> str:
    """The option nearest to a value."""
    return min(options, key=lambda name: abs(options[name] - value))
