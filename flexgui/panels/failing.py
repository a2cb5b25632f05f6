"""Where the model fails: maps of its error, and its worst places as buttons."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from core.diagnose.phrases import FLOOR_IS
from core.results import ErrorMap, ErrorMaps, ErrorOver, RecordingComparison, WorstCell
from flexgui.panels import widgets
from flexgui.panels.desk import Desk
from flexgui.panels.missing import Missing
from flexgui.panels.plot import Plot
from flexgui.panels.words import Words, paragraph
from flexgui.views.error_map import error_map, place
from flexgui.views.names import output_title
from flexgui.views.numbers import format_number
from flexgui.views.residual_over import residual_over

SIGNALS, FREQUENCY, TIME, MOTION, TORQUE = (
    "signals", "map: by frequency", "map: by time", "error over the motion",
    "missing joint torque",
)  # fmt: skip
SHOWN = (SIGNALS, FREQUENCY, TIME, MOTION, TORQUE)
WORST = 10
PATTERN = 0.05
"""Share of the error's variance below which a pattern over the motion is not drawn."""

FLOOR = f"× means times the floor. {FLOOR_IS}"
NO_PATTERN = "The error follows neither speed, place, acceleration nor deflection."
MAPS = {
    FREQUENCY: "Working point × frequency, in times the floor: pale is noise, dark is failing.",
    TIME: "Working point × time, in times the floor: pale is noise, dark is failing.",
    MOTION: "Measured minus model over the motion; both directions apart.",
}


class Failing:
    """What of the comparison is shown, and the ten worst cells."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._shown = SIGNALS
        self._of: object = None
        self._maps: ErrorMaps | None = None
        self._redraw: Callable[[], None] = lambda: None
        self._choice = widgets.choice(
            desk, "Show", SHOWN, lambda: self._shown, self._picked,
            "The maps show where the error stands above the noise.",
        )  # fmt: skip
        self._folder: Any = desk.gui.add_folder("The worst places", visible=False)
        with self._folder:
            Words(desk.gui, paragraph(FLOOR, "soft"))
            self._buttons = [self._button(k) for k in range(WORST)]

    def _button(self, k: int) -> Any:
        return widgets.button(self._desk, f"{k + 1}.", lambda: self._go_to(k))

    def build_plots(self) -> None:
        """Inside the container that is open."""
        self._about = Words(self._desk.gui)
        # One for each kind of figure: axes that turn round stay so in a panel that is used again.
        self._map, self._over = Plot(self._desk.gui, 0.9), Plot(self._desk.gui, 0.9)
        self._missing = Missing(self._desk)
        self._drawn: object = None

    def refresh(self, current: RecordingComparison | None, redraw: Callable[[], None]) -> bool:
        """Whether the signals themselves are to be shown; `current` is under the cursor."""
        self._redraw = redraw
        failing = self._desk.session.failing
        if self._of is not failing:
            self._of, self._drawn = failing, None
            self._maps = None if failing is None else failing.maps
            self._label()
        torques = () if current is None else current.missing_torque
        self._missing.refresh(torques if self._shown == TORQUE and self._maps else None)
        if self._maps is None or self._shown in (SIGNALS, TORQUE):
            self._about.show("")
            self._map.show(None)
            self._over.show(None)
            self._drawn = None
            return self._maps is None or self._shown == SIGNALS
        if self._drawn != self._shown:
            self._drawn = self._shown
            self._draw(self._maps)
        return False

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        self._missing.move_cursor()

    def _draw(self, maps: ErrorMaps) -> None:
        over = self._shown == MOTION
        figure = residual_over(patterns(maps)) if over else error_map(_of(maps, self._shown), True)
        said = MAPS[self._shown] if figure is not None else NO_PATTERN
        self._about.show(paragraph(said, "lead"))
        self._over.show_whole(figure if over else None)
        self._map.show_whole(None if over else figure)

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
        cell, session = worst[k], self._desk.session
        in_time = cell.axis == "time"
        at = 0.5 * (cell.low + cell.high) if in_time else worst_time(self._maps, cell)
        session.set_cursor(recording=cell.recording, time=at, playing=False)
        self._shown = SIGNALS if in_time else FREQUENCY
        self._choice.value = self._shown
        self._redraw()


def worst_time(maps: ErrorMaps, cell: WorstCell) -> float:
    """s: the middle of the window in which the cell's output of its recording is worst."""
    m = next(m for m in maps.by_time if m.channel == cell.channel)
    row = m.ratio[m.recordings.index(cell.recording)]
    j = int(np.argmax(np.where(np.isfinite(row), row, -1.0)))
    return float(0.5 * (m.edges[j] + m.edges[j + 1]))


def _of(maps: ErrorMaps, shown: str) -> tuple[ErrorMap, ...]:
    return maps.by_frequency if shown == FREQUENCY else maps.by_time


def patterns(maps: ErrorMaps) -> list[ErrorOver]:
    """The clearest pattern over each quantity of the motion."""
    best: dict[str, ErrorOver] = {}
    for one in maps.over:
        if one.explained >= PATTERN:
            best.setdefault(one.quantity, one)
    return list(best.values())


def cell_label(cell: WorstCell) -> str:
    """'recording th3: tip z₁, 0.5 to 0.7 s, 8.2 ×'; a button has room for little more."""
    times = format_number(cell.ratio, 2, keep_zeros=True)
    output = output_title(cell.channel, cell.unit)
    short = output.replace("joint angle", "angle").replace("tip position", "tip")
    return f"recording {cell.recording}: {short}, {place(cell)}, {times} ×"
