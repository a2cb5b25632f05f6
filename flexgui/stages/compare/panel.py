"""Fourth stage: measured against modelled, recording by recording, and where the model fails."""

from __future__ import annotations

from dataclasses import replace

import msgspec

from flexgui.core.results import (
    ErrorMaps,
    RecordingComparison,
    WorstCell,
)
from flexgui.page.earlier_work import FIT, other_settings
from flexgui.page.panel import Panel
from flexgui.page.tour import to_diagnosis
from flexgui.page.widgets import (
    HtmlBlock,
    button,
    choice,
    folded,
    paragraph,
    set_options,
)
from flexgui.sentences.figures import FLOOR_IS
from flexgui.session.state import Topic
from flexgui.stages.compare.panel_plots import (
    ALL,
    WORDS,
    WORST,
    ErrorView,
    OwnPlot,
    Signals,
    Torque,
    worst_time,
)
from flexgui.stages.compare.state import SIGNALS
from flexgui.views.fit_table import FIT_IS, fit_table
from flexgui.views.names import output_title
from flexgui.views.of_recording import recording_views
from flexgui.views.summary import which_fit
from flexgui.views.table import Table, html_table

NONE = "nothing to compare yet"
NO_MODEL = "no other model"
TORQUE, OWN = "missing joint torque", "signals of my choice"
"""All others are found in flexgui/views/of_recording."""


def shown_titles() -> tuple[str, ...]:
    """Titles of the views that can be chosen."""
    return (SIGNALS, OWN, *(view.title for view in recording_views().values()), TORQUE)


class ComparePanel(Panel):
    """Right: choices and the table of errors. Left: the chosen view."""

    kind = "Compare"
    topics = frozenset({Topic.SCENARIO, Topic.OUTCOME, Topic.RECORDINGS, Topic.DIAGNOSIS})

    def build_controls(self) -> None:
        context = self.context
        self._lead = HtmlBlock(self.gui)
        self._back = button(
            context, "Identify first", lambda: self.session.show("Identify"), prominent=True
        )
        self._next = button(
            context, "Next: diagnose", lambda: to_diagnosis(context), prominent=True
        )
        self._wanted_output = WORST
        self._outputs = {WORST: WORST}
        """What is offered -> a channel, or several."""
        self._choice = choice(context, "Recording", (NONE,), self._name, self._chosen)
        self._output = choice(context, "Output", (WORST,), self._output_name, self._choose_output)
        self._show = choice(
            context, "Show", shown_titles(), self._view, self._choose,
            "The maps show where the error is above the noise floor.",
        )  # fmt: skip
        self._beside = choice(
            context, "Beside", (NO_MODEL,), self._beside_name, self._choose_beside,
            "Another model of this session, drawn beside the present one.",
        )  # fmt: skip
        self._worst, self._table = HtmlBlock(self.gui), HtmlBlock(self.gui)
        context.actions.register("worst place", self._go_to)
        context.actions.register("map cell", self._go_to_cell)

    def build_plots(self) -> None:
        self._about = HtmlBlock(self.gui)
        self._signals = Signals(self.context)
        self.context.theme.callbacks.append(self._recolour)
        views = recording_views().values()
        self._shown: dict[str, Signals | OwnPlot | ErrorView | Torque] = {
            SIGNALS: self._signals,
            OWN: OwnPlot(self.context),
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
        others = tuple(self._others())
        self._beside.visible = len(others) > 1
        set_options(self._beside, others, self._beside_name())
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
            pending = self.session.diagnosis.pending is not None
            note = "" if pending else other_settings(self.session, FIT)
            self._lead.show(note, WORDS.quality(current))
            table = html_table(_short(fit_table(self._comparisons)))
            self._table.show(
                folded("FIT and noise floor", WORDS.figures(table, FIT_IS, FLOOR_IS, which))
            )
        self._draw()

    def _draw(self) -> None:
        current = self._current()
        failing = self.session.comparison.failing
        shown = SIGNALS if failing is None and self._view() != OWN else self._view()
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

    def _view(self) -> str:
        view = self.session.comparison.view
        return view if view in shown_titles() else SIGNALS

    def _others(self) -> dict[str, int | None]:
        """What can be drawn beside: title -> number of the model."""
        models = self.session.diagnosis.models
        others = (m for m in models.comparable if m is not models.present)
        return {NO_MODEL: None} | {f"{m.number}. {m.title}": m.number for m in others}

    def _beside_name(self) -> str:
        beside = self.session.diagnosis.models.beside
        chosen = None if beside is None else beside.number
        return next((name for name, n in self._others().items() if n == chosen), NO_MODEL)

    def _choose_beside(self, name: str) -> None:
        self.session.diagnosis.models.show_beside(self._others().get(name))

    def _choose(self, title: str) -> None:
        self._show.value = title
        self.session.comparison.show_view(title)

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


def _short(table: Table) -> Table:
    """The table without the columns that do not fit beside the arm."""
    rows = tuple(row for row in table.rows if not row.cells[2].endswith("*"))
    return replace(table, rows=rows).only((0, 2, 3, 4), "The report holds every output.")
