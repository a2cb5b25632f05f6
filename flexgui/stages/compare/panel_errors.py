"""Where the model fails: maps of its error, and its worst places as buttons."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from flexgui.core.results import ErrorMaps, MissingTorque, RecordingComparison, WorstCell
from flexgui.page import widgets
from flexgui.page.panel import PageContext
from flexgui.page.plot import Plot
from flexgui.page.widgets import Words, paragraph
from flexgui.sentences.figures import FLOOR_IS
from flexgui.sentences.written import format_number
from flexgui.views.error_map import place
from flexgui.views.missing_torque import missing_cloud, missing_curve
from flexgui.views.names import output_title
from flexgui.views.of_recording import recording_views
from flexgui.views.of_recording.errors import ErrorByFrequency
from flexgui.views.of_recording.view import RecordingView, Seen

SIGNALS, TORQUE = "signals", "missing joint torque"
"""These two follow the time-line's cursor; all others are found in flexgui/views/of_recording."""
WORST = 10

FLOOR = f"× means times the noise floor. {FLOOR_IS}"


class Failing:
    """What of the comparison is shown, and the ten worst cells."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._shown = SIGNALS
        self._of: object = None
        self._maps: ErrorMaps | None = None
        self._redraw: Callable[[], None] = lambda: None
        self._views = {view.title: view for view in recording_views().values()}
        shown = (SIGNALS, *self._views, TORQUE)
        self._choice = widgets.choice(
            context, "Show", shown, lambda: self._shown, self._picked,
            "The maps show where the error exceeds the noise floor.",
        )  # fmt: skip
        self._folder: Any = context.gui.add_folder("The worst places", visible=False)
        with self._folder:
            Words(context.gui, paragraph(FLOOR, "soft"))
            self._buttons = [self._button(k) for k in range(WORST)]

    def _button(self, k: int) -> Any:
        return widgets.button(self._context, f"{k + 1}.", lambda: self._go_to(k))

    def build_plots(self) -> None:
        """Inside the container that is open."""
        self._about = Words(self._context.gui)
        # One for each view: axes that turn round stay so in a panel that is used again.
        self._plots = {title: Plot(self._context.gui, 0.9) for title in self._views}
        self._missing = Missing(self._context)
        self._drawn: object = None

    def refresh(self, current: RecordingComparison | None, redraw: Callable[[], None]) -> bool:
        """Whether the signals themselves are to be shown; `current` is under the cursor."""
        self._redraw = redraw
        failing = self._context.session.comparison.failing
        if self._of is not failing:
            self._of, self._drawn = failing, None
            self._maps = None if failing is None else failing.maps
            self._label()
        torques = () if current is None else current.missing_torque
        self._missing.refresh(torques if self._shown == TORQUE and self._maps else None)
        view = self._views.get(self._shown)
        if self._maps is None or current is None or view is None:
            self._about.show("")
            self._hide_but(None)
            self._drawn = None
            return self._maps is None or self._shown == SIGNALS
        if self._drawn != (view.kind, current.recording):
            self._drawn = (view.kind, current.recording)
            self._draw(view, Seen(current, self._context.session.comparison.shown, self._maps))
        return False

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        self._missing.move_cursor()

    def _draw(self, view: RecordingView, seen: Seen) -> None:
        figure = view.draw(seen)
        self._about.show(paragraph(view.nothing if figure is None else view.about, "lead"))
        self._hide_but(view.title)
        self._plots[view.title].show_whole(figure)

    def _hide_but(self, shown: str | None) -> None:
        for title, plot in self._plots.items():
            if title != shown:
                plot.show(None)

    def _label(self) -> None:
        worst = self._worst()
        self._folder.visible = bool(worst)
        for k, button in enumerate(self._buttons):
            button.visible = k < len(worst)
            if k < len(worst):
                button.label = cell_label(worst[k])

    def _worst(self) -> Sequence[WorstCell]:
        return () if self._maps is None else self._maps.worst[:WORST]

    def _picked(self, name: str) -> bool:
        self._shown = name
        self._redraw()
        return True

    def _go_to(self, k: int) -> None:
        """Arm, time-line and plots go to the cell; for a band of frequencies to where in its
        recording the output is worst."""
        worst = self._worst()
        if self._maps is None or k >= len(worst):
            return
        cell, session = worst[k], self._context.session
        in_time = cell.axis == "time"
        at = 0.5 * (cell.low + cell.high) if in_time else worst_time(self._maps, cell)
        session.playback.move(recording=cell.recording, time=at, playing=False)
        self._shown = SIGNALS if in_time else ErrorByFrequency.title
        self._choice.value = self._shown
        self._redraw()


def worst_time(maps: ErrorMaps, cell: WorstCell) -> float:
    """s: the middle of the window in which the cell's output of its recording is worst."""
    m = next(m for m in maps.by_time if m.channel == cell.channel)
    row = m.ratio[m.recordings.index(cell.recording)]
    j = int(np.argmax(np.where(np.isfinite(row), row, -1.0)))
    return float(0.5 * (m.edges[j] + m.edges[j + 1]))


def cell_label(cell: WorstCell) -> str:
    """'recording th3: tip z₁, 0.5 to 0.7 s, 8.2 ×'; a button has room for little more."""
    times = format_number(cell.ratio, 2, keep_zeros=True)
    output = output_title(cell.channel, cell.unit)
    short = output.replace("joint angle", "angle").replace("tip position", "tip")
    short = short.replace("deflection of the link", "deflection")
    return f"recording {cell.recording}: {short}, {place(cell)}, {times} ×"


EXPLANATION = (
    "The torque that the drive delivers beyond what the model needs for the measured motion. Over "
    "the speed: a step at zero is dry friction, a slope viscous friction, a cloud without shape is "
    "noise."
)
NONE = (
    "No missing torque is known for this recording: press Find what is missing first. It needs a "
    "working point (or a torque rig), since it is computed with the model linearised there."
)


class Missing:
    """Hidden unless it was asked for."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._words = Words(context.gui)
        self._curve, self._cloud = Plot(context.gui, 0.75), Plot(context.gui, 0.75)
        self._drawn: tuple[MissingTorque, ...] | None = None

    def refresh(self, torques: tuple[MissingTorque, ...] | None) -> None:
        """None hides it; an empty tuple says why there is nothing."""
        self._words.show(
            "" if torques is None else paragraph(EXPLANATION if torques else NONE, "soft")
        )
        if not torques:
            self._drawn = None
            self._curve.show(None)
            self._cloud.show(None)
            return
        if torques is not self._drawn:
            self._drawn = torques
            self._curve.show(missing_curve(torques), self._cursor())
            self._cloud.show(missing_cloud(torques))

    def _cursor(self) -> float | None:
        if not self._drawn:
            return None
        return float(self._drawn[0].time[0]) + self._context.session.playback.cursor.time

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        if self._drawn:
            self._curve.move_cursor(self._cursor())
