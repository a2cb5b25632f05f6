"""The time-line below the arm: one cursor for the arm, its ghost and the plots.

`browser/timeline.js` draws it: its state is sent when it changes, and its buttons are actions."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

from flexgui.page.in_browser import run_javascript
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.scene_panel import COLOURED, legend, plays
from flexgui.scene.error_board import greatest
from flexgui.scene.paint import DIRECTIONS
from flexgui.scene.recorded_motion import MOST_PLAYED
from flexgui.stages.diagnose.effects import places
from flexgui.views import colours
from flexgui.views.error_map import error_text as error_words

SPEEDS = (0.1, 0.25, 0.5, 1, 2)
ERRORS = (1, 5, 20, 100)
"""Factors of the drawn distance between measured arm and model, to separate two close arms."""
UNREAD = "The recording is not read yet. It will play here."


class TimeLine(PageElement):
    """Play, time, speed, and the direction of view."""

    def __init__(self, context: PageContext, look_from: Callable[[str], None]) -> None:
        """`look_from` turns the view of the arm to one of DIRECTIONS."""
        super().__init__(context)
        self._sent = ""
        context.theme.callbacks.append(lambda _: self.refresh())
        playback, actions = self.session.playback, context.actions
        actions.register("play", lambda _: playback.move(playing=not playback.cursor.playing))
        actions.register("seek", lambda text: self._with_number(text, playback.seek))
        actions.register("step", lambda text: self._with_number(text, self._step))
        actions.register("speed", lambda text: self._with_number(text, self._speed))
        actions.register("apart", lambda text: self._with_number(text, self._error))
        actions.register("view", lambda side: look_from(side) if side in DIRECTIONS else None)

    def _with_number(self, text: str, move: Callable[[float], object]) -> None:
        """Calls `move` with the number in the text; ignores other texts."""
        try:
            value = float(text)
        except ValueError:
            return
        if math.isfinite(value):
            move(value)

    def _step(self, seconds: float) -> None:
        """From where the cursor stands: the browser may not know it yet."""
        playback = self.session.playback
        playback.seek(playback.cursor.time + seconds)

    def _speed(self, value: float) -> None:
        if value in SPEEDS:
            self.session.playback.move(speed=value)

    def _error(self, value: float) -> None:
        if value in ERRORS:
            self.session.playback.move(error=value)

    def refresh(self) -> None:
        """Sends the state to the browser if it has changed."""
        state = json.dumps(self._state(), ensure_ascii=False)
        if state != self._sent:
            self._sent = state
            run_javascript(self.context.client, f"window.fxLine && window.fxLine({state})")

    def _state(self) -> dict[str, Any]:
        session, cursor = self.session, self.session.playback.cursor
        motion = session.playback.motion
        effects = [
            f"In the model: {title}, at the {place}."
            for title, place in places(session.document.scenario)
        ]
        always = {
            "views": list(DIRECTIONS), "follows": self.context.read_only, "effects": effects,
        }  # fmt: skip
        if motion is None or not plays(session):
            waits = motion is None and session.document.scenario.recordings
            return {**always, "plays": False, "words": [UNREAD] if waits else [], "scale": ""}
        who = "identified model" if motion.fitted else "model as stated"
        failing = session.comparison.on_arm if session.stage in COLOURED else None
        signal = None if failing is None else failing.now.get(cursor.recording)
        error_text = "" if signal is None else error_words(signal.at(cursor.time), signal.units)
        worst = 0.0 if signal is None else greatest(session.comparison.worst_error)
        scale = colours.RISING_ON_DARK if self.context.theme.dark else colours.RISING
        if session.recordings.rig.is_asked:
            who = "an example arm at the recorded angles"
        part = session.playback.recording
        is_part = part is not None and len(part.time) > MOST_PLAYED
        first = f"{motion.recording}{', its beginning' if is_part else ''}: {who}."
        return {
            **always, "plays": True, "playing": cursor.playing, "seconds": motion.seconds,
            "time": round(cursor.time, 2), "speed": cursor.speed, "speeds": SPEEDS,
            "error": cursor.error, "errors": ERRORS, "measured": motion.ghost is not None,
            "words": [text for text in (first, legend(session), error_text) if text],
            "scale": f"{worst:.3g}" if worst > 1.0 else "",
            "colours": ", ".join(colour for _, colour in scale),
        }  # fmt: skip
