"""What Compare draws: the signals of a recording, a view of its error, its missing torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexgui.core.results import (
    ChannelComparison,
    ErrorMaps,
    MissingTorque,
    RecordingComparison,
    WorstCell,
)
from flexgui.page.actions import press
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.plot import Plot
from flexgui.page.widgets import (
    HtmlBlock,
    paragraph,
    stage_macros,
)
from flexgui.sentences.written import channel_symbol, format_number, quantity
from flexgui.views.comparison import live_comparison
from flexgui.views.error_map import error_map, place
from flexgui.views.fit_table import ROLES, bar_label, fit_dots
from flexgui.views.layout import Figure
from flexgui.views.missing_torque import missing_cloud, missing_curve
from flexgui.views.names import output_title
from flexgui.views.of_recording.view import RecordingView, Seen
from flexgui.views.own_plot import own_plot, signals_of

STANDS_OUT = 2.0
"""Times the noise floor, from which a place is worth a look."""
WORDS = stage_macros(
    "compare", channel_symbol=channel_symbol, quantity=quantity, press=press, place=place,
    output_title=output_title, format_number=format_number, stands_out=STANDS_OUT,
)  # fmt: skip
ALL, WORST = "all fitted outputs", "largest error"
LEAST_HEIGHT, HEIGHT_PER_OUTPUT = 380.0, 200.0
"""px of the signals: the name of each axis needs its room."""


class Signals(PageElement):
    """Measurement, model and residual of the chosen outputs, error map and FIT."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.output = WORST
        self.chosen: WorstCell | None = None
        """Of the worst places, the one that was pressed."""
        self._about = HtmlBlock(self.gui)
        self._curves, self._map, self._fit = (
            Plot(context, aspect, wide=True) for aspect in (0.98, 0.5, 0.33)
        )
        self._drawn: RecordingComparison | None = None

    def show(self, current: RecordingComparison | None) -> None:
        """Shows the recording at the cursor; None hides it."""
        self._drawn = current
        if current is None:
            self._about.show()
            for plot in (self._curves, self._map, self._fit):
                plot.show(None)
            return
        shown, failing = self._channels(current), self.session.comparison.failing
        units = {k.channel: k.unit for k in current.channels}
        output = output_title(shown[0], units[shown[0]]) if len(shown) == 1 else ALL
        name = bar_label(current, self.session.comparison.shown)
        role = ROLES.get(current.role, current.role)
        self._about.show(paragraph(f"Recording {name}, {role}: {output}", "lead"))
        height = max(LEAST_HEIGHT, HEIGHT_PER_OUTPUT * len(shown))
        floors = {} if failing is None else failing.floors
        other = self.session.comparison.beside(current.recording)
        curves = live_comparison(current, shown, floors, other)
        self._curves.show(curves, beginning(current), height)
        self._map.show_whole(None if failing is None else self._map_of(failing.maps, shown))
        self._fit.show_whole(fit_dots(self.session.comparison.shown))
        self.move_cursor()

    def _map_of(self, maps: ErrorMaps, shown: Sequence[str]) -> Figure | None:
        """The map over time, or over frequency if a frequency band was chosen."""
        cell = self.chosen if self.chosen is not None and self.chosen.channel in shown else None
        each = maps.by_time if cell is None or cell.axis == "time" else maps.by_frequency
        wanted = [m for m in each if m.channel in shown]
        return error_map(wanted, True, cell, self.context.theme.dark)

    def _channels(self, current: RecordingComparison) -> tuple[str, ...]:
        if self.output == WORST:
            failing = self.session.comparison.failing
            return (worst_output(current, {} if failing is None else failing.floors),)
        fitted = tuple(c.channel for c in current.channels if c.fitted)
        return fitted if self.output == ALL else (self.output,)

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        if self._drawn is not None:
            self._curves.move_cursor(beginning(self._drawn))
            self._map.move_cursor(0.0)


def beginning(current: RecordingComparison) -> float:
    """Time of the first sample that is compared, s."""
    return float(current.channels[0].time[0]) if current.channels else 0.0


def worst_output(c: RecordingComparison, floors: Mapping[str, float]) -> str:
    """The output with the largest error in noise floors, or in its own spread without one."""

    def error(k: ChannelComparison) -> float:
        unit = floors.get(k.channel) or float(np.std(k.measured[k.counted])) or 1.0
        counts = k.counted & np.isfinite(k.residual)
        return (
            float(np.sqrt(np.mean(np.square(k.residual[counts])))) / unit if counts.any() else 0.0
        )

    compared = [k for k in c.channels if (k.fitted or k.channel in floors) and k.counted.any()]
    return max(compared or c.channels, key=error).channel


class ErrorView(PageElement):
    """A view of the error of one recording, with a plot of its own."""

    def __init__(self, context: PageContext, view: RecordingView) -> None:
        super().__init__(context)
        self._view = view
        self._about, self._plot = HtmlBlock(self.gui), Plot(context, 0.9)
        self._drawn: tuple[object, ...] = ()

    def show(self, current: RecordingComparison | None) -> None:
        """Shows the recording at the cursor; None hides it."""
        failing, dark = self.session.comparison.failing, self.context.theme.dark
        if current is None or failing is None:
            self._drawn = ()
            self._about.show()
            self._plot.show(None)
        elif self._drawn != (key := (id(failing), current.recording, dark)):
            self._drawn = key
            seen = Seen(current, self.session.comparison.shown, failing.maps, dark)
            figure = self._view.draw(seen)
            about = self._view.nothing if figure is None else self._view.about
            self._about.show(paragraph(about, "lead"))
            self._plot.show_whole(figure)
        self.move_cursor()

    def move_cursor(self) -> None:
        """The browser draws the cursor on a time axis."""
        if self._drawn:
            self._plot.move_cursor(0.0)


class OwnPlot(PageElement):
    """Signals that a person picks; the choice is kept with the work."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words = HtmlBlock(self.gui)
        self._plot = Plot(context, 0.9, wide=True)
        self._drawn: RecordingComparison | None = None
        context.actions.register("pick signal", self.session.comparison.pick)

    def show(self, current: RecordingComparison | None) -> None:
        """Shows the recording at the cursor; None hides it."""
        comparison, recording = self.session.comparison, self.session.playback.recording
        self._drawn = current
        if current is None:
            self._words.show()
            self._plot.show(None)
            return
        same = recording is not None and recording.name == current.recording
        signals = signals_of(current, recording if same else None)
        self._words.show(WORDS.pick(signals, comparison.picked))
        figure = own_plot(signals, comparison.picked)
        rows = len({signals[key].unit for key in comparison.picked if key in signals})
        self._plot.show(figure, beginning(current), OWN_ROW * (1.0 + rows))

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        if self._drawn is not None:
            self._plot.move_cursor(beginning(self._drawn))


OWN_ROW = 150.0
"""px of a pane of chosen signals."""


class Torque(PageElement):
    """The missing torque over time and over speed."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words = HtmlBlock(self.gui)
        self._curve, self._cloud = Plot(context, 0.75), Plot(context, 0.75)
        self._drawn: tuple[MissingTorque, ...] = ()

    def show(self, current: RecordingComparison | None) -> None:
        """Shows the recording at the cursor, or why there is no torque; None hides it."""
        torques = () if current is None else current.missing_torque
        self._words.show("" if current is None else WORDS.torque(bool(torques)))
        if not torques:
            self._curve.show(None)
            self._cloud.show(None)
        elif torques is not self._drawn:
            self._curve.show(missing_curve(torques), float(torques[0].time[0]))
            self._cloud.show(missing_cloud(torques))
        self._drawn = torques

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        if self._drawn:
            self._curve.move_cursor(float(self._drawn[0].time[0]))


def worst_time(maps: ErrorMaps, cell: WorstCell) -> float:
    """s: middle of the window in which the output of this cell has its largest error."""
    m = next(m for m in maps.by_time if m.channel == cell.channel)
    row = m.ratio[m.recordings.index(cell.recording)]
    j = int(np.argmax(np.where(np.isfinite(row), row, -1.0)))
    return float(0.5 * (m.edges[j] + m.edges[j + 1]))
