"""Fourth stage: measured against modelled, recording by recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from flexgui.core.results import ChannelComparison, RecordingComparison
from flexgui.page import widgets
from flexgui.page.panel import Panel
from flexgui.page.plot import Plot
from flexgui.page.tour import to_diagnosis
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.sentences.written import channel_symbol, quantity
from flexgui.session import Topic
from flexgui.stages.compare.panel_errors import Failing
from flexgui.views.comparison import live_comparison
from flexgui.views.fit_table import FIT_IS, ROLES, fit_table, live_fit
from flexgui.views.html import html_table
from flexgui.views.names import format_percent, output_title
from flexgui.views.pooled import VALIDATE
from flexgui.views.summary import which_fit
from flexgui.views.table import Table

NONE = "nothing to compare yet"
ALL, WORST = "all fitted outputs", "the one that fails most"
HEIGHT, HEIGHT_PER_OUTPUT = 440.0, 200.0
"""px of the signals: the name of each axis needs its room."""

EMPTY = (
    "After an identification this shows, for every recording and output, the measurement, the "
    "model and the residual, and the FIT of each recording as a bar."
)


class ComparePanel(Panel):
    """Choices and the table of errors on the right; signals, residuals and FIT on the left."""

    kind: ClassVar[str] = "Compare"
    topics: ClassVar[frozenset[Topic]] = frozenset(
        {Topic.OUTCOME, Topic.RECORDINGS, Topic.DIAGNOSIS}
    )

    def build_controls(self) -> None:
        context, session = self.context, self.context.session
        self._lead = Words(context.gui)
        self._back = widgets.button(
            context, "Identify first", lambda: session.show("Identify"), prominent=True
        )
        self._next = widgets.button(
            context, "Next: diagnose", lambda: to_diagnosis(context), prominent=True
        )
        self._shown_output = WORST
        self._choice = widgets.choice(context, "Recording", (NONE,), self._name, self._chosen)
        self._output = widgets.choice(
            context, "Output", (WORST,), lambda: self._shown_output, self._picked
        )
        self._sweep = widgets.button(context, "Show the validation", self._validation)
        self._failing = Failing(context)
        self._table = Words(context.gui)

    def build_plots(self) -> None:
        gui = self.context.gui
        self._about = Words(gui)
        self._signals, self._bars = Plot(gui, 0.98), Plot(gui, 0.33)
        self._failing.build_plots()

    @property
    def _comparisons(self) -> tuple[RecordingComparison, ...]:
        return self.context.session.comparison.shown

    def _current(self) -> RecordingComparison | None:
        name = self.context.session.playback.cursor.recording
        found = [c for c in self._comparisons if c.recording == name]
        return next(iter(found or self._comparisons), None)

    def _name(self) -> str:
        current = self._current()
        return NONE if current is None else current.recording

    def refresh(self) -> None:
        current = self._current()
        known = current is not None
        self._back.visible, self._next.visible = not known, known
        self._sweep.visible = any(c.role == VALIDATE for c in self._comparisons)
        names = tuple(dict.fromkeys(c.recording for c in self._comparisons)) or (NONE,)
        _offer(self._choice, names, current.recording if current else NONE)
        if current is None:
            self._about.show(paragraph(EMPTY, "soft"))
            for each in (self._signals, self._bars):
                each.show(None)
            self._lead.show(paragraph("Nothing was identified yet.", "lead"))
            self._table.show("")
            self._failing.refresh(None, self.refresh)
            return
        outputs = (WORST, ALL, *(c.channel for c in current.channels))
        self._shown_output = self._shown_output if self._shown_output in outputs else WORST
        _offer(self._output, outputs, self._shown_output)
        signals = self._failing.refresh(current, self.refresh)
        shown = self._channels(current)
        self._about.show(paragraph(_title(current, shown), "lead") if signals else "")
        figure = live_comparison(current, shown) if signals else None
        self._signals.show(figure, self._cursor(), max(HEIGHT, HEIGHT_PER_OUTPUT * len(shown)))
        self._bars.show(live_fit(self._comparisons) if signals else None)
        quality = joined(*(paragraph(t) for t in _quality(current)))
        self._lead.show(quality + paragraph(f"{FIT_IS} {self._which()}", "soft"))
        self._table.show(html_table(_short(fit_table(self._comparisons))))

    def _which(self) -> str:
        """Which fit the errors are of: they change where the diagnosis has made its own."""
        outcome = self.context.session.identification.outcome
        return which_fit(self._comparisons, () if outcome is None else outcome.fits)

    def _channels(self, current: RecordingComparison) -> tuple[str, ...]:
        fitted = tuple(c.channel for c in current.channels if c.fitted)
        if self._shown_output == WORST:
            failing = self.context.session.comparison.failing
            return (worst_output(current, {} if failing is None else failing.floors),)
        return fitted if self._shown_output == ALL else (self._shown_output,)

    def _cursor(self) -> float | None:
        session, current = self.context.session, self._current()
        if current is None or not current.channels:
            return None
        return float(current.channels[0].time[0]) + session.playback.cursor.time

    def move_cursor(self) -> None:
        self._signals.move_cursor(self._cursor())
        self._failing.move_cursor()

    def _chosen(self, name: str) -> bool:
        if name == NONE:
            return False
        self.context.session.playback.move(recording=name, time=0.0)
        return True

    def _picked(self, name: str) -> bool:
        self._shown_output = name
        self.refresh()
        return True

    def _validation(self) -> None:
        found = next((c for c in self._comparisons if c.role == VALIDATE), None)
        if found is not None:
            self.context.session.playback.move(recording=found.recording, time=0.0, playing=True)


def _offer(dropdown: Any, options: tuple[str, ...], value: str) -> None:
    if dropdown.options != options:
        dropdown.options = options
    if dropdown.value != value:
        dropdown.value = value


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


def _title(c: RecordingComparison, shown: Sequence[str]) -> str:
    which = f": {output_title(*_named(c, shown[0]))}" if len(shown) == 1 else ""
    return f"Recording {c.recording}, {ROLES.get(c.role, c.role)}, fit of {c.fit_label}{which}"


def _named(c: RecordingComparison, channel: str) -> tuple[str, str]:
    return channel, next(k.unit for k in c.channels if k.channel == channel)


def _quality(c: RecordingComparison) -> list[str]:
    fits = [
        f"{format_percent(k.fit_percent)} % in {channel_symbol(k.channel, k.unit)}"
        for k in c.channels
        if k.fitted
    ]
    sentences = [f"Recording {c.recording}: FIT {', '.join(fits)}."]
    if c.tip_rms is not None:
        sentences.append(f"The model misses the measured tip by {quantity(c.tip_rms, 'm')} rms.")
    return [*sentences, c.note] if c.note else sentences


def _short(table: Table) -> Table:
    """The fitted outputs, with what fits beside the arm: recording, output, FIT, rms."""
    rows = tuple(row for row in table.rows if not row.cells[2].endswith("*"))
    return replace(table, rows=rows).only((0, 2, 3, 4), "The report holds every output.")
