"""Which column of a file is which channel: shown while a file waits for it."""

from __future__ import annotations

import math
from typing import Any

from markupsafe import Markup

from flexgui.page import widgets
from flexgui.page.panel import PageContext
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.stages.data.panel_own import TOP
from flexgui.stages.data.rows import SPLIT
from flexgui.stages.data.waiting_file import POINT, Waiting
from flexgui.views.preview import title_of
from flexgui.views.sketch import sparkline

PICTURE = (96, 26)
"""px: three cells of a row fit a panel of 340."""
ALL_KNOWN = "All required signals are assigned."
REST = "Read the file, or assign another column."


class ColumnChoice:
    """One question at a time, what is needed first; then the file is read."""

    def __init__(self, context: PageContext) -> None:
        self._context, gui = context, context.gui
        self._shown: Waiting | None = None
        self._folder = gui.add_folder("Which column is which", order=TOP, visible=False)
        with self._folder:
            self._lead = Words(gui)
            self._rows = RowChoice(context)
            self._read = widgets.button(
                context,
                "Read the file",
                lambda: context.session.recordings.read_waiting(),
                prominent=True,
            )
            self._correcting = False
            self._correct = widgets.button(context, "Correct a row", self._begin_correcting)
            self._more = gui.add_folder("Correct a row")
            with self._more:
                self._question_controls()
                self._again = widgets.button(
                    context, "Start over", lambda: context.session.recordings.ask_again()
                )
            widgets.button(
                context, "Cancel import", lambda: context.session.recordings.leave_file()
            )

    def _question_controls(self) -> None:
        context, gui, off = self._context, self._context.gui, self._context.read_only
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
        self._assign = widgets.button(context, "Use this column", self._put, prominent=True)
        self._point: Any = gui.add_number("Fixed at [deg]", 90.0, step=0.1, disabled=off)
        self._stood = widgets.button(context, "No column: θ₂ was fixed", self._put_point)
        self._none = widgets.button(
            context, "The file has none", lambda: context.session.recordings.no_column(self._asked)
        )

    def refresh(self) -> None:
        """Hidden where no file waits."""
        waiting, before = self._context.session.recordings.waiting, self._shown
        self._shown = waiting
        self._correcting = self._correcting and waiting is not None
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
        lead = paragraph(f"{waiting.file}{_more(waiting)}: {state}")
        self._lead.show(joined(lead, _known(waiting), rows_words(waiting)))
        self._rows.show(waiting)
        self._more.visible = bool(open_) or self._correcting
        self._correct.visible = not self._more.visible
        self._show_question()

    def _begin_correcting(self) -> None:
        self._correcting = True
        if self._shown is not None:
            self._draw(self._shown)

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
        channels = {waiting.words(c): c for c in waiting.offered}
        return channels.get(str(self._channel.value), waiting.offered[0])

    def _put(self) -> bool:
        gain = float(self._gain.value)
        if not math.isfinite(gain) or gain == 0.0:
            self._context.session.show_message(
                "The scale factor must not be zero; change it.", bad=True
            )
            return False
        return self._context.session.recordings.map_column(
            self._asked, str(self._column.value), gain,
            -1 if self._negative.value else 1, str(self._unit.value),
        )  # fmt: skip

    def _put_point(self) -> None:
        waiting, value = self._shown, float(self._point.value)
        if waiting is None or not math.isfinite(value):
            return
        turns = waiting.units.get(POINT, "rad") == "rad"
        self._context.session.recordings.answer(theta2=math.radians(value) if turns else value)


def _more(waiting: Waiting) -> str:
    """The files that are read with the same table."""
    count = len(waiting.companions)
    if not count:
        return ""
    return " and one more file" if count == 1 else f" and {count} more files with the same columns"


def _known(waiting: Waiting) -> Markup:
    """A row per signal that the rig needs or the file has: its column, a picture, the check."""
    shown = [c for c in waiting.offered if c in waiting.known or c in waiting.needed]
    rows = [_row(waiting, channel) for channel in shown]
    frame = Markup("<div class='scroll'><table class='signals'><tbody>{}</tbody></table></div>")
    return frame.format(Markup("").join(rows)) if rows else Markup("")


def _row(waiting: Waiting, channel: str) -> Markup:
    words, header = waiting.words(channel).removeprefix("the "), waiting.known.get(channel)
    if header is None:
        at = _fixed(waiting) if channel == POINT and waiting.theta2 is not None else ""
        state = Markup("<td class='{}'>{}</td>").format("" if at else "alarm", at or "missing")
        return Markup("<tr><td><b>{}</b></td><td></td>{}</tr>").format(words, state)
    cell = Markup("<td><b>{}</b><br><span class='soft'>{}</span></td>").format(
        words, _source(waiting, channel, header)
    )
    return Markup("<tr>{}<td>{}</td>{}</tr>").format(
        cell, _drawn(waiting, header), _judged(waiting, channel)
    )


def _source(waiting: Waiting, channel: str, header: str) -> str:
    """'enc_1 [deg], × −1'"""
    entry = waiting.columns.get(channel)
    factor = 1.0 if entry is None else entry["gain"] * entry["sign"]
    name = header if entry is None else entry["name"]
    return name if factor == 1.0 else f"{name}, × {factor:g}".replace("-", "−")


def _drawn(waiting: Waiting, header: str) -> Markup:
    found = None if waiting.inspection is None else waiting.inspection.pictures.get(header)
    return Markup("") if found is None else sparkline(*found, size=PICTURE, title=header)


def _judged(waiting: Waiting, channel: str) -> Markup:
    wording, inspection = waiting.wording_of(channel), waiting.inspection
    if wording is not None:
        text, evidence = title_of(wording[0]), wording[1]
        return Markup("<td class='alarm' title='{}'>{}</td>").format(evidence, text)
    changed = None if inspection is None else inspection.taken_in.get(channel)
    if changed is not None:
        return Markup("<td class='soft'>{}</td>").format(changed)
    return Markup("<td>{}</td>").format("✓" if inspection is not None else "")


def _fixed(waiting: Waiting) -> str:
    degrees = waiting.units.get(POINT, "rad") == "rad"
    value = waiting.theta2 or 0.0
    return f"fixed at {math.degrees(value):g}°" if degrees else f"fixed at {value:g} m"


def _offer(dropdown: Any, options: tuple[str, ...], value: str) -> None:
    if dropdown.options != options:
        dropdown.options = options
    chosen = value if value in options else options[0]
    if dropdown.value != chosen:
        dropdown.value = chosen


GAPS = {
    "Split into recordings": SPLIT,
    "Interpolate": "interpolate",
    "Interpolate, without counting them": "mask",
    "Keep the longest part without gaps": "cut",
}
CLOCK = {
    "Interpolate to an even clock": "interpolate",
    "Rows are even, their times are not": "count",
}
AS_RECORDED = "As recorded"
FAST = 2000.0
"""Hz: the links' modes end below 100 Hz, twenty samples each; above it rows cost time only."""
RATES = (5000.0, 2000.0, 1000.0, 500.0)
"""Hz, that are offered where a log is faster."""


class RowChoice:
    """Dropdowns that are there only where there is something to choose."""

    def __init__(self, context: PageContext) -> None:
        self._context, session = context, context.session
        self._clock = self._dropdown(
            "Uneven time", CLOCK, lambda text: session.recordings.answer(clock=CLOCK[text])
        )
        self._gaps = self._dropdown(
            "Gaps", GAPS, lambda text: session.recordings.answer(gaps=GAPS[text])
        )
        self._rate = self._dropdown(
            "Sample rate", (AS_RECORDED,), lambda text: session.recordings.answer(rate=_rate(text))
        )

    def _dropdown(self, label: str, options: Any, put: Any) -> Any:
        context = self._context
        handle: Any = context.gui.add_dropdown(
            label, tuple(options), disabled=context.read_only, visible=False
        )

        def chosen(event: Any) -> None:
            if event.client_id is not None:  # not where the page itself has set it
                put(str(handle.value))

        if not context.read_only:
            handle.on_update(chosen)
        return handle

    def show(self, waiting: Waiting) -> None:
        """What there is to choose for these files."""
        uneven = any(each.uneven for each in waiting.rows)
        self._clock.visible = uneven
        if uneven:
            self._clock.value = next(w for w, how in CLOCK.items() if how == waiting.clock)
        how = waiting.gaps_chosen
        self._gaps.visible = bool(how)
        if how:
            self._gaps.value = next(w for w, known in GAPS.items() if known == how)
        usual = max(each.rate for each in waiting.rows)
        self._rate.visible = usual > FAST
        if usual > FAST:
            options = (AS_RECORDED, *(_words(r) for r in RATES if r < usual))
            if self._rate.options != options:
                self._rate.options = options
            self._rate.value = AS_RECORDED if waiting.rate is None else _words(waiting.rate)


def rows_words(waiting: Waiting) -> Markup:
    """A line for each file of which something has to be said."""
    found = []
    for file, rows in zip(waiting.files, waiting.rows, strict=True):
        lead = "" if len(waiting.files) == 1 else f"{file}: "
        found += [paragraph(f"{lead}{rows.uneven}")] if rows.uneven else []
        if rows.empty:
            counts = ", ".join(f"{count} in {header}" for header, count in rows.empty.items())
            longest = f"the longest gap lasts {rows.longest_gap:.3g} s"
            found.append(paragraph(f"{lead}Empty cells: {counts}; {longest}."))
    return joined(*found) if found else Markup("")


def _words(rate: float) -> str:
    return f"{rate:g} Hz"


def _rate(text: str) -> float | None:
    return None if text == AS_RECORDED else float(text.removesuffix(" Hz"))
