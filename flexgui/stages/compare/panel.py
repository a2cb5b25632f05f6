"""Fourth stage: measured against modelled, recording by recording, and where the model fails."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from flexgui.core.results import (
    ChannelComparison,
    ErrorMaps,
    MissingTorque,
    RecordingComparison,
    WorstCell,
)
from flexgui.page.panel import PageContext, Panel, Piece
from flexgui.page.plot import Plot
from flexgui.page.tour import to_diagnosis
from flexgui.page.widgets import Words, button, choice, offer, paragraph, words_of
from flexgui.sentences.figures import FLOOR_IS
from flexgui.sentences.written import channel_symbol, format_number, quantity
from flexgui.session.state import Topic
from flexgui.stages.compare.state import WhereItFails
from flexgui.views.comparison import live_comparison
from flexgui.views.error_map import place
from flexgui.views.fit_table import FIT_IS, ROLES, fit_table, live_fit
from flexgui.views.missing_torque import missing_cloud, missing_curve
from flexgui.views.names import format_percent, output_title
from flexgui.views.of_recording import recording_views
from flexgui.views.of_recording.errors import ErrorByFrequency
from flexgui.views.of_recording.view import RecordingView, Seen
from flexgui.views.pooled import VALIDATE
from flexgui.views.summary import which_fit
from flexgui.views.table import Table, html_table

WORDS = words_of(
    "compare", format_percent=format_percent, channel_symbol=channel_symbol, quantity=quantity
)
NONE = "nothing to compare yet"
ALL, WORST = "all fitted outputs", "the one that fails most"
SIGNALS, TORQUE = "signals", "missing joint torque"
"""These two follow the time-line's cursor; all others are found in flexgui/views/of_recording."""
HEIGHT, HEIGHT_PER_OUTPUT = 440.0, 200.0
"""px of the signals: the name of each axis needs its room."""
MOST_CELLS = 10


def shown_titles() -> tuple[str, ...]:
    """What can be shown of a comparison."""
    return (SIGNALS, *(view.title for view in recording_views().values()), TORQUE)


class ComparePanel(Panel):
    """Choices and the table of errors on the right; what is chosen to be shown on the left."""

    kind = "Compare"
    topics = frozenset({Topic.OUTCOME, Topic.RECORDINGS, Topic.DIAGNOSIS})

    def build_controls(self) -> None:
        context = self.context
        self._lead = Words(self.gui)
        self._back = button(
            context, "Identify first", lambda: self.session.show("Identify"), prominent=True
        )
        self._next = button(
            context, "Next: diagnose", lambda: to_diagnosis(context), prominent=True
        )
        self._wanted, self._wanted_output = SIGNALS, WORST
        self._choice = choice(context, "Recording", (NONE,), self._name, self._chosen)
        self._output = choice(
            context, "Output", (WORST,), lambda: self._wanted_output, self._choose_output
        )
        self._sweep = button(context, "Show the validation", self._validation)
        self._show = choice(
            context, "Show", shown_titles(), lambda: self._wanted, self._choose,
            "The maps show where the error exceeds the noise floor.",
        )  # fmt: skip
        self._worst = WorstPlaces(context, self._choose)
        self._table = Words(self.gui)

    def build_plots(self) -> None:
        self._about = Words(self.gui)
        self._signals = Signals(self.context)
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
        found = [c for c in self._comparisons if c.recording == name]
        return next(iter(found or self._comparisons), None)

    def _name(self) -> str:
        current = self._current()
        return NONE if current is None else current.recording

    def refresh(self) -> None:
        current, failing = self._current(), self.session.comparison.failing
        self._back.visible = current is None
        self._next.visible = current is not None
        self._sweep.visible = any(c.role == VALIDATE for c in self._comparisons)
        names = tuple(dict.fromkeys(c.recording for c in self._comparisons)) or (NONE,)
        offer(self._choice, names, self._name())
        self._worst.refresh(failing)
        self._about.show(WORDS.nothing_yet() if current is None else "")
        if current is None:
            self._lead.show(paragraph("Nothing was identified yet.", "lead"))
            self._table.show()
        else:
            offer(
                self._output, (WORST, ALL, *(c.channel for c in current.channels)),
                self._wanted_output,
            )  # fmt: skip
            self._wanted_output = self._signals.output = self._output.value
            outcome = self.session.identification.outcome
            # Which fit the errors are of: they change where the diagnosis has made its own.
            which = which_fit(self._comparisons, () if outcome is None else outcome.fits)
            self._lead.show(WORDS.quality(current, f"{FIT_IS} {which}"))
            self._table.show(html_table(_short(fit_table(self._comparisons))))
        shown = SIGNALS if failing is None else self._wanted
        for title, each in self._shown.items():
            each.show(current if title == shown else None)

    def move_cursor(self) -> None:
        for each in self._shown.values():
            each.move_cursor()

    def _chosen(self, name: str) -> bool:
        if name == NONE:
            return False
        self.session.playback.move(recording=name, time=0.0)
        return True

    def _choose_output(self, name: str) -> None:
        self._wanted_output = name
        self.refresh()

    def _choose(self, title: str) -> None:
        self._wanted = self._show.value = title
        self.refresh()

    def _validation(self) -> None:
        found = next((c for c in self._comparisons if c.role == VALIDATE), None)
        if found is not None:
            self.session.playback.move(recording=found.recording, time=0.0, playing=True)


class Signals(Piece):
    """Measurement, model and residual of the chosen outputs, and the FIT of all recordings."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.output = WORST
        self._about = Words(self.gui)
        self._curves, self._bars = Plot(context, 0.98), Plot(context, 0.33)
        self._drawn: RecordingComparison | None = None

    def show(self, current: RecordingComparison | None) -> None:
        """Of the recording under the cursor; None hides it."""
        self._drawn = current
        if current is None:
            self._about.show()
            self._curves.show(None)
            self._bars.show(None)
            return
        shown = self._channels(current)
        units = {k.channel: k.unit for k in current.channels}
        output = output_title(shown[0], units[shown[0]]) if len(shown) == 1 else ""
        self._about.show(WORDS.title(current, ROLES.get(current.role, current.role), output))
        height = max(HEIGHT, HEIGHT_PER_OUTPUT * len(shown))
        self._curves.show(live_comparison(current, shown), self._cursor(), height)
        self._bars.show(live_fit(self.session.comparison.shown))

    def _channels(self, current: RecordingComparison) -> tuple[str, ...]:
        if self.output == WORST:
            failing = self.session.comparison.failing
            return (worst_output(current, {} if failing is None else failing.floors),)
        fitted = tuple(c.channel for c in current.channels if c.fitted)
        return fitted if self.output == ALL else (self.output,)

    def _cursor(self) -> float | None:
        channels = () if self._drawn is None else self._drawn.channels
        start = next((float(k.time[0]) for k in channels), None)
        return None if start is None else start + self.session.playback.cursor.time

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        self._curves.move_cursor(self._cursor())


def worst_output(c: RecordingComparison, floors: Mapping[str, float]) -> str:
    """The output whose error is largest, of those that are fitted or have a noise floor, as the
    map of errors counts it: in its floor; in its own spread where none is known."""

    def error(k: ChannelComparison) -> float:
        unit = floors.get(k.channel) or float(np.std(k.measured[k.counted])) or 1.0
        counts = k.counted & np.isfinite(k.residual)
        return (
            float(np.sqrt(np.mean(np.square(k.residual[counts])))) / unit if counts.any() else 0.0
        )

    known = [k for k in c.channels if (k.fitted or k.channel in floors) and k.counted.any()]
    return max(known or c.channels, key=error).channel


def _short(table: Table) -> Table:
    """The fitted outputs, with what fits beside the arm: recording, output, FIT, rms."""
    rows = tuple(row for row in table.rows if not row.cells[2].endswith("*"))
    return replace(table, rows=rows).only((0, 2, 3, 4), "The report holds every output.")


class ErrorView(Piece):
    """A view of the error of one recording. Each has a plot of its own: axes that turn round stay
    so in a panel that is used again."""

    def __init__(self, context: PageContext, view: RecordingView) -> None:
        super().__init__(context)
        self._view = view
        self._about, self._plot = Words(self.gui), Plot(context, 0.9)
        self._drawn: tuple[object, object] = (None, None)

    def show(self, current: RecordingComparison | None) -> None:
        """Of the recording under the cursor; None hides it."""
        failing = self.session.comparison.failing
        if current is None or failing is None:
            self._drawn = (None, None)
            self._about.show()
            self._plot.show(None)
        elif self._drawn[0] is not failing or self._drawn[1] != current.recording:
            self._drawn = (failing, current.recording)
            figure = self._view.draw(Seen(current, self.session.comparison.shown, failing.maps))
            about = self._view.nothing if figure is None else self._view.about
            self._about.show(paragraph(about, "lead"))
            self._plot.show_whole(figure)

    def move_cursor(self) -> None:
        """Its axis is no time."""


class Torque(Piece):
    """The missing torque over time and over speed."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words = Words(self.gui)
        self._curve, self._cloud = Plot(context, 0.75), Plot(context, 0.75)
        self._drawn: tuple[MissingTorque, ...] = ()

    def show(self, current: RecordingComparison | None) -> None:
        """Of the recording under the cursor, or why there is none; None hides it."""
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


class WorstPlaces(Piece):
    """The ten worst cells of the maps as buttons; `choose` shows what the cell is a part of."""

    def __init__(self, context: PageContext, choose: Callable[[str], None]) -> None:
        super().__init__(context)
        self._choose = choose
        self._failing: WhereItFails | None = None
        self._folder: Any = self.gui.add_folder("The worst places", visible=False)
        with self._folder:
            Words(self.gui, WORDS.noise_floor(FLOOR_IS))
            self._buttons = [
                button(context, f"{k + 1}.", partial(self._go_to, k)) for k in range(MOST_CELLS)
            ]

    def refresh(self, failing: WhereItFails | None) -> None:
        """Labels the buttons."""
        self._failing = failing
        worst = () if failing is None else failing.maps.worst[:MOST_CELLS]
        self._folder.visible = bool(worst)
        for k, each in enumerate(self._buttons):
            each.visible = k < len(worst)
            if each.visible:
                each.label = cell_label(worst[k])

    def _go_to(self, k: int) -> None:
        """Arm, time-line and plots go to the cell; for a band of frequencies to where in its
        recording the output is worst."""
        if self._failing is None or k >= len(self._failing.maps.worst):
            return
        maps = self._failing.maps
        cell = maps.worst[k]
        in_time = cell.axis == "time"
        at = 0.5 * (cell.low + cell.high) if in_time else worst_time(maps, cell)
        self.session.playback.move(recording=cell.recording, time=at, playing=False)
        self._choose(SIGNALS if in_time else ErrorByFrequency.title)


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
