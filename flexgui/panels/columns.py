"""Which column of a file is which channel: shown while a file waits for it."""

from __future__ import annotations

import math
from typing import Any

from markupsafe import Markup

from flexgui.panels import widgets
from flexgui.panels.desk import Desk
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session.columns import Waiting
from flexgui.views.html import html_table
from flexgui.views.table import Column, Row, Table

ROWS = (Column("Channel"), Column("Column of the file"), Column("Gain", numeric=True))


class ColumnChoice:
    """One channel at a time, the needed ones first; then the file is read."""

    def __init__(self, desk: Desk) -> None:
        self._desk, gui = desk, desk.gui
        self._shown: Waiting | None = None
        self._folder = gui.add_folder("Which column is which", visible=False)
        with self._folder:
            self._said = Words(gui)
            self._channel: Any = gui.add_dropdown("Channel", ("t",), disabled=desk.read_only)
            self._column: Any = gui.add_dropdown("Is column", ("–",), disabled=desk.read_only)
            self._unit: Any = gui.add_text(
                "Unit", "", disabled=desk.read_only,
                hint="Where the heading has none: deg, mm, 1/s …; SI where empty.",
            )  # fmt: skip
            self._gain: Any = gui.add_number("Times", 1.0, step=0.01, disabled=desk.read_only)
            self._negative: Any = gui.add_checkbox("Turn its sign", False, disabled=desk.read_only)
            self._assign = widgets.button(desk, "That column it is", self._put, prominent=True)
            self._read = widgets.button(
                desk, "Read the file", lambda: desk.session.read_waiting(), prominent=True
            )
            widgets.button(desk, "Leave it", lambda: desk.session.leave_waiting())

    def refresh(self) -> None:
        """Hidden where no file waits."""
        waiting = self._desk.session.waiting
        self._folder.visible = waiting is not None
        if waiting is None or waiting is self._shown:
            self._shown = waiting
            return
        self._shown = waiting
        missing = waiting.missing
        _offer(self._channel, waiting.offered, missing[0] if missing else self._channel.value)
        _offer(self._column, waiting.headers, self._column.value)
        self._unit.value, self._gain.value, self._negative.value = "", 1.0, False
        self._read.visible = not missing
        wanted = (
            f"Still needed: {', '.join(missing)}." if missing else "All that is needed is known."
        )
        self._said.show(joined(paragraph(f"{waiting.file}: {wanted}"), _known(waiting)))

    def _put(self) -> bool:
        gain = float(self._gain.value)
        if not math.isfinite(gain) or gain == 0.0:
            self._desk.session.say("A column times zero is nothing; give another number.", bad=True)
            return False
        return self._desk.session.map_column(
            str(self._channel.value), str(self._column.value), gain,
            -1 if self._negative.value else 1, str(self._unit.value),
        )  # fmt: skip


def _known(waiting: Waiting) -> Markup:
    if not waiting.columns:
        return paragraph("Columns with a channel's own name need no choice.", "soft")
    rows = tuple(
        Row((channel, entry["name"], f"{entry['gain'] * entry['sign']:g}"))
        for channel, entry in waiting.columns.items()
    )
    return html_table(Table(ROWS, rows))


def _offer(dropdown: Any, options: tuple[str, ...], value: str) -> None:
    if dropdown.options != options:
        dropdown.options = options
    chosen = value if value in options else options[0]
    if dropdown.value != chosen:
        dropdown.value = chosen
