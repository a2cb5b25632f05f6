"""Fourth stage: measured against modelled, recording by recording, and where the model fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import msgspec
import numpy as np

from flexgui.core.results import (
    ChannelComparison,
    ErrorMaps,
    MissingTorque,
    RecordingComparison,
    WorstCell,
)
from flexgui.page.actions import press
from flexgui.page.panel import PageContext, PageElement, Panel
from flexgui.page.plot import Plot
from flexgui.page.tour import to_diagnosis
from flexgui.page.widgets import (
    HtmlBlock,
    button,
    choice,
    folded,
    paragraph,
    set_options,
    stage_macros,
)
from flexgui.sentences.figures import FLOOR_IS
from flexgui.sentences.written import channel_symbol, format_number, quantity
from flexgui.session.state import Topic
from flexgui.views.comparison import live_comparison
from flexgui.views.error_map import error_map, place
from flexgui.views.fit_table import FIT_IS, ROLES, bar_label, fit_dots, fit_table
from flexgui.views.layout import Figure
from flexgui.views.missing_torque import missing_cloud, missing_curve
from flexgui.views.names import output_title
from flexgui.views.of_recording import recording_views
from flexgui.views.of_recording.view import RecordingView, Seen
from flexgui.views.summary import which_fit
from flexgui.views.table import Table, html_table

STANDS_OUT = 2.0
"""Times the noise floor, from which a place is worth a look."""
WORDS = stage_macros(
    "compare", channel_symbol=channel_symbol, quantity=quantity, press=press, place=place,
    output_title=output_title, format_number=format_number, stands_out=STANDS_OUT,
)  # fmt: skip
NONE = "nothing to compare yet"
ALL, WORST = "all fitted outputs", "largest error"
SIGNALS, TORQUE = "signals", "missing joint torque"
"""All others are found in flexgui/views/of_recording."""
HEIGHT, HEIGHT_PER_OUTPUT = 380.0, 200.0
"""px of the signals: the name of each axis needs its room."""


def shown_titles() -> tuple[str, ...]:
    """Titles of the views that can be chosen."""
    return (SIGNALS, *(view.title for view in recording_views().values()), TORQUE)


class ComparePanel(Panel):
    """Right: choices and the table of errors. Left: the chosen view."""

    kind = "Compare"
    topics = frozenset({Topic.OUTCOME, Topic.RECORDINGS, Topic.DIAGNOSIS})

    def build_controls(self) -> None:
        context = self.context
        self._lead = HtmlBlock(self.gui)
        self._back = button(
            context, "Identify first", lambda: self.session.show("Identify"), prominent=True
        )
        self._next = button(
            context, "Next: diagnose", lambda: to_diagnosis(context), prominent=True
        )
        self._wanted, self._wanted_output = SIGNALS, WORST
        self._outputs = {WORST: WORST}
        """What is offered -> a channel, or several."""
        self._choice = choice(context, "Recording", (NONE,), self._name, self._chosen)
        self._output = choice(context, "Output", (WORST,), self._output_name, self._choose_output)
        self._show = choice(
            context, "Show", shown_titles(), lambda: self._wanted, self._choose,
            "The maps show where the error is above the noise floor.",
        )  # fmt: skip
        self._worst, self._table = HtmlBlock(self.gui), HtmlBlock(self.gui)
        context.actions.register("worst place", self._go_to)
        context.actions.register("map cell", self._go_to_cell)

    def build_plots(self) -> None:
        self._about = HtmlBlock(self.gui)
        self._signals = Signals(self.context)
        self.context.theme.callbacks.append(self._recolour)
        views = recording_views().values()
        self._shown: dict[str, Signals | ErrorView | Torque] = {
            SIGNALS: self._signals,
            **{view.title: ErrorView(self.context, view) for view in views},
            TORQUE: Torque(self.context),
        }

    @property
    def _comparisons(self) -> tuple[RecordingComparison, ...]:
        return self.session.comparison.shown

    def _current(self) -> RecordingComparison | None:
        name = self.session.playback.cursor.recording
        matches = [c for c in self._comparisons if c.recording == name]
        return next(iter(matches or self._comparisons), None)

    def _name(self) -> str:
        current = self._current()
        return NONE if current is None else current.recording

    def refresh(self) -> None:
        current, failing = self._current(), self.session.comparison.failing
        self._back.visible = current is None
        self._next.visible = current is not None
        names = tuple(dict.fromkeys(c.recording for c in self._comparisons)) or (NONE,)
        set_options(self._choice, names, self._name())
        worst = () if failing is None else failing.maps.worst
        chosen = self._signals.chosen if self._signals.chosen in worst else None
        self._signals.chosen = chosen
        self._worst.show(WORDS.worst(worst, chosen))
        self._about.show(WORDS.nothing_yet() if current is None else "")
        if current is None:
            self._lead.show(paragraph("Nothing was identified yet.", "lead"))
            self._table.show()
        else:
            self._outputs = {name: name for name in (WORST, ALL)} | {
                output_title(c.channel, c.unit): c.channel for c in current.channels
            }
            set_options(self._output, tuple(self._outputs), self._output_name())
            self._wanted_output = self._outputs[self._output.value]
            self._signals.output = self._wanted_output
            outcome = self.session.identification.outcome
            # Which fit the errors are of: they change where the diagnosis has made its own.
            which = which_fit(self._comparisons, () if outcome is None else outcome.fits)
            self._lead.show(WORDS.quality(current))
            table = html_table(_short(fit_table(self._comparisons)))
            self._table.show(
                folded("FIT and noise floor", WORDS.figures(table, FIT_IS, FLOOR_IS, which))
            )
        self._draw()

    def _draw(self) -> None:
        current = self._current()
        shown = SIGNALS if self.session.comparison.failing is None else self._wanted
        for title, each in self._shown.items():
            each.show(current if title == shown else None)

    def _recolour(self, _: bool) -> None:
        if self.session.stage == self.kind:
            self._draw()

    def move_cursor(self) -> None:
        for each in self._shown.values():
            each.move_cursor()

    def _chosen(self, name: str) -> bool:
        if name == NONE:
            return False
        self.session.playback.move(recording=name, time=0.0)
        return True

    def _output_name(self) -> str:
        offered = {channel: name for name, channel in self._outputs.items()}
        return offered.get(self._wanted_output, WORST)

    def _choose_output(self, name: str) -> None:
        self._wanted_output = self._outputs.get(name, WORST)
        self.refresh()

    def _choose(self, title: str) -> None:
        self._wanted = self._show.value = title
        self.refresh()

    def _go_to(self, place: str) -> None:
        """Moves arm, time-line and plots to one of the worst places."""
        failing = self.session.comparison.failing
        worst = () if failing is None else failing.maps.worst
        cell = dict(zip(map(str, range(len(worst))), worst, strict=True)).get(place)
        if failing is not None and cell is not None:
            self._show_cell(failing.maps, cell)

    def _go_to_cell(self, place: str) -> None:
        """Moves there as well; `place`: axis and channel of a map, row and column, as JSON."""
        failing = self.session.comparison.failing
        if failing is None:
            return
        maps = {(m.axis, m.channel): m for m in (*failing.maps.by_time, *failing.maps.by_frequency)}
        try:
            axis, channel, row, column = msgspec.json.decode(place, type=tuple[str, str, int, int])
            cell = maps[axis, channel].cell(abs(row), abs(column))
        except (msgspec.MsgspecError, LookupError, ValueError):
            return  # not of these maps
        self._show_cell(failing.maps, cell)

    def _show_cell(self, maps: ErrorMaps, cell: WorstCell) -> None:
        self._signals.chosen = cell
        self._wanted_output = cell.channel
        in_time = cell.axis == "time"
        at = 0.5 * (cell.low + cell.high) if in_time else worst_time(maps, cell)
        self.session.playback.move(recording=cell.recording, time=at, playing=False)
        self._choose(SIGNALS)


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
        height = max(HEIGHT, HEIGHT_PER_OUTPUT * len(shown))
        floors = {} if failing is None else failing.floors
        self._curves.show(live_comparison(current, shown, floors), height=height)
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
        channels = () if self._drawn is None else self._drawn.channels
        if channels:
            time = self.session.playback.cursor.time
            self._curves.move_cursor(float(channels[0].time[0]) + time)
            self._map.move_cursor(time)


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


def _short(table: Table) -> Table:
    """The table without the columns that do not fit beside the arm."""
    rows = tuple(row for row in table.rows if not row.cells[2].endswith("*"))
    return replace(table, rows=rows).only((0, 2, 3, 4), "The report holds every output.")


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
            self._plot.move_cursor(self.session.playback.cursor.time)


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
            self._curve.show(missing_curve(torques), self._cursor(torques))
            self._cloud.show(missing_cloud(torques))
        self._drawn = torques

    def _cursor(self, torques: tuple[MissingTorque, ...]) -> float:
        return float(torques[0].time[0]) + self.session.playback.cursor.time

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        if self._drawn:
            self._curve.move_cursor(self._cursor(self._drawn))


def worst_time(maps: ErrorMaps, cell: WorstCell) -> float:
    """s: middle of the window in which the output of this cell has its largest error."""
    m = next(m for m in maps.by_time if m.channel == cell.channel)
    row = m.ratio[m.recordings.index(cell.recording)]
    j = int(np.argmax(np.where(np.isfinite(row), row, -1.0)))
    return float(0.5 * (m.edges[j] + m.edges[j + 1]))
