"""Which column of a file is which channel: shown while a file waits for it."""

from __future__ import annotations

import math
from typing import Any

from markupsafe import Markup

from flexgui.panels import widgets
from flexgui.panels.arrivals import TOP
from flexgui.panels.page_context import PageContext
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session.columns import POINT, Waiting
from flexgui.views.html import html_table
from flexgui.views.table import Column, Row, Table

ROWS = (Column("What"), Column("Column of the file"), Column("Scale factor", numeric=True))
ALL_KNOWN = "All required signals are assigned."
REST = "Read the file, or assign another column."


class ColumnChoice:
    """One question at a time, what is needed first; then the file is read."""

    def __init__(self, desk: PageContext) -> None:
        self._desk, gui = desk, desk.gui
        self._shown: Waiting | None = None
        self._folder = gui.add_folder("Which column is which", order=TOP, visible=False)
        with self._folder:
            self._said = Words(gui)
            self._question_controls()
            self._again = widgets.button(desk, "Start over", lambda: desk.session.ask_again())
            self._read = widgets.button(
                desk, "Read the file", lambda: desk.session.read_waiting(), prominent=True
            )
            widgets.button(desk, "Cancel import", lambda: desk.session.leave_file())

    def _question_controls(self) -> None:
        desk, gui, off = self._desk, self._desk.gui, self._desk.read_only
        self._channel: Any = gui.add_dropdown("Signal", ("–",), disabled=off)
        if not off:
            self._channel.on_update(lambda _: self._show_question())
        self._question = Words(gui)
        self._column: Any = gui.add_dropdown("Column", ("–",), disabled=off)
        self._unit: Any = gui.add_text(
            "Unit", "", disabled=off,
            hint="If the heading has no unit: deg, mm, 1/s …; empty means SI.",
        )  # fmt: skip
        self._gain: Any = gui.add_number("Scale factor", 1.0, step=0.01, disabled=off)
        self._negative: Any = gui.add_checkbox("Invert sign", False, disabled=off)
        self._assign = widgets.button(desk, "Use this column", self._put, prominent=True)
        self._point: Any = gui.add_number("Fixed at [deg]", 90.0, step=0.1, disabled=off)
        self._stood = widgets.button(desk, "No column: θ₂ was fixed", self._put_point)
        self._none = widgets.button(
            desk, "The file has none", lambda: desk.session.no_column(self._asked)
        )

    def refresh(self) -> None:
        """Hidden where no file waits."""
        waiting, before = self._desk.session.waiting, self._shown
        self._shown = waiting
        if waiting is not None and waiting is not before:
            self._draw(waiting)
        self._folder.visible = waiting is not None

    def _draw(self, waiting: Waiting) -> None:
        open_ = waiting.questions
        words = tuple(waiting.words(c) for c in waiting.offered)
        _offer(self._channel, words, waiting.words(open_[0]) if open_ else self._channel.value)
        free = waiting.unused
        _offer(self._column, waiting.headers, free[0] if free else self._column.value)
        self._unit.value, self._gain.value, self._negative.value = "", 1.0, False
        self._again.visible = bool(waiting.columns or waiting.absent or waiting.theta2 is not None)
        self._read.visible = not waiting.missing
        self._read.color = "gray" if open_ else "blue"
        self._assign.color = "blue" if open_ else "gray"
        left = len(waiting.missing)
        state = f"Signals still missing: {left}." if left else ALL_KNOWN
        self._said.show(joined(paragraph(f"{waiting.file}: {state}"), _known(waiting)))
        self._show_question()

    def _show_question(self) -> None:
        waiting = self._shown
        if waiting is None:
            return
        asked = self._asked
        question = f"Which column is {waiting.words(asked)}?" if waiting.questions else REST
        self._question.show(paragraph(question, "lead"))
        turns = waiting.units.get(POINT, "rad") == "rad"
        self._point.label = "Fixed at [deg]" if turns else "Fixed at [m]"
        still = asked == POINT and POINT in waiting.missing
        self._point.visible = self._stood.visible = still
        self._none.visible = asked in waiting.questions and asked not in waiting.missing

    @property
    def _asked(self) -> str:
        """The channel that is asked for."""
        waiting = self._shown
        if waiting is None:
            return ""
        said = {waiting.words(c): c for c in waiting.offered}
        return said.get(str(self._channel.value), waiting.offered[0])

    def _put(self) -> bool:
        gain = float(self._gain.value)
        if not math.isfinite(gain) or gain == 0.0:
            self._desk.session.show_message(
                "The scale factor must not be zero; change it.", bad=True
            )
            return False
        return self._desk.session.map_column(
            self._asked, str(self._column.value), gain,
            -1 if self._negative.value else 1, str(self._unit.value),
        )  # fmt: skip

    def _put_point(self) -> None:
        waiting, value = self._shown, float(self._point.value)
        if waiting is None or not math.isfinite(value):
            return
        turns = waiting.units.get(POINT, "rad") == "rad"
        self._desk.session.stood_at(math.radians(value) if turns else value)


def _known(waiting: Waiting) -> Markup:
    """What is known, also by a column's own name."""
    rows = []
    for channel in (c for c in waiting.offered if c in waiting.known):
        entry = waiting.columns.get(channel)
        factor = "" if entry is None else f"{entry['gain'] * entry['sign']:g}"
        header = waiting.known[channel] if entry is None else entry["name"]
        rows.append(Row((waiting.words(channel).removeprefix("the "), header, factor)))
    if waiting.theta2 is not None and POINT not in waiting.known:
        degrees = waiting.units.get(POINT, "rad") == "rad"
        place = f"{math.degrees(waiting.theta2):g}°" if degrees else f"{waiting.theta2:g} m"
        rows.append(Row((waiting.words(POINT).removeprefix("the "), f"fixed at {place}", "")))
    return html_table(Table(ROWS, tuple(rows))) if rows else Markup("")


def _offer(dropdown: Any, options: tuple[str, ...], value: str) -> None:
    if dropdown.options != options:
        dropdown.options = options
    chosen = value if value in options else options[0]
    if dropdown.value != chosen:
        dropdown.value = chosen
