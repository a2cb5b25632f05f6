"""Assigns the columns of an uploaded file to channels."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from markupsafe import Markup

from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, button, color, on_user_input, set_options
from flexgui.stages.data.panel_own import TOP, WORDS
from flexgui.stages.data.panel_rig import rig_choices
from flexgui.stages.data.rows import SPLIT
from flexgui.stages.data.waiting_file import POINT, WaitingFile
from flexgui.views.preview import title_of, with_symbols
from flexgui.views.sketch import sparkline

PICTURE = (96, 26)
"""px: three cells of a row fit a panel of 340."""


class ColumnChoice(PageElement):
    """Asks for one channel at a time, required ones first; then the file is read."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        gui, recordings = self.gui, self.session.recordings
        self._shown: WaitingFile | None = None
        self._folder = gui.add_folder("Which column is which", order=TOP, visible=False)
        with self._folder:
            self._lead = HtmlBlock(gui)
            self._rows = RowChoice(context)
            self._read = button(context, "Read the file", recordings.read_waiting, prominent=True)
            self._correcting = False
            self._correct = button(context, "Correct a row", self._begin_correcting)
            self._more = gui.add_folder("Correct a row")
            with self._more:
                self._question_controls()
                self._again = button(context, "Start over", recordings.ask_again)
            button(context, "Cancel import", recordings.leave_file)

    def _question_controls(self) -> None:
        context, gui = self.context, self.gui
        self._channel: Any = gui.add_dropdown("Signal", ("–",))
        on_user_input(context, self._channel, self._show_question)
        self._question = HtmlBlock(gui)
        self._column: Any = gui.add_dropdown("Column", ("–",))
        unit = "If the heading has no unit: deg, mm, 1/s …; empty means SI."
        self._unit: Any = gui.add_text("Unit", "", hint=unit)
        self._gain: Any = gui.add_number("Scale factor", 1.0, step=0.01)
        self._negative: Any = gui.add_checkbox("Invert sign", False)
        self._assign = button(context, "Use this column", self._put, prominent=True)
        self._point: Any = gui.add_number("Fixed at [deg]", 90.0, step=0.1)
        self._stood = button(context, "No column: θ₂ was fixed", self._put_point)
        self._none = button(
            context, "The file has none", lambda: self.session.recordings.no_column(self._asked)
        )

    def refresh(self) -> None:
        """Hides the fields if no file waits."""
        waiting, before = self.session.recordings.waiting, self._shown
        self._shown = waiting
        self._correcting = self._correcting and waiting is not None
        if waiting is not None and waiting is not before:
            self._draw(waiting)
        self._folder.visible = waiting is not None

    def _draw(self, waiting: WaitingFile) -> None:
        open_ = waiting.questions
        words = tuple(waiting.words(c) for c in waiting.offered)
        set_options(self._channel, words, waiting.words(open_[0]) if open_ else self._channel.value)
        free = waiting.unused
        set_options(self._column, waiting.headers, free[0] if free else self._column.value)
        self._unit.value, self._gain.value, self._negative.value = "", 1.0, False
        self._again.visible = bool(waiting.columns or waiting.absent or waiting.theta2 is not None)
        self._read.visible = not waiting.missing
        self._read.color, self._assign.color = color(not open_), color(bool(open_))
        shown = [c for c in waiting.offered if c in waiting.known or c in waiting.needed]
        rows = [] if waiting.suits else [_row(waiting, channel) for channel in shown]
        rig = rig_choices(self.session.document.scenario)
        self._lead.show(WORDS.columns(waiting, rig, rows))
        self._rows.show(waiting)
        self._more.visible = bool(open_ and not waiting.suits) or self._correcting
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
        self._question.show(WORDS.question(waiting.words(asked) if waiting.questions else ""))
        self._point.label = "Fixed at [deg]" if _turns(waiting) else "Fixed at [m]"
        still = asked == POINT and POINT in waiting.missing
        self._point.visible = self._stood.visible = still
        self._none.visible = asked in waiting.questions and asked not in waiting.missing

    @property
    def _asked(self) -> str:
        """The channel to assign next."""
        waiting = self._shown
        if waiting is None:
            return ""
        channels = {waiting.words(c): c for c in waiting.offered}
        return channels.get(str(self._channel.value), waiting.offered[0])

    def _put(self) -> None:
        gain = float(self._gain.value)
        if not math.isfinite(gain) or gain == 0.0:
            self.session.refuse("The scale factor must not be zero.")
            return
        sign = -1 if self._negative.value else 1
        column, unit = str(self._column.value), str(self._unit.value)
        self.session.recordings.map_column(self._asked, column, gain, sign, unit)

    def _put_point(self) -> None:
        waiting, value = self._shown, float(self._point.value)
        if waiting is not None and math.isfinite(value):
            theta2 = math.radians(value) if _turns(waiting) else value
            self.session.recordings.answer(theta2=theta2)


def _turns(waiting: WaitingFile) -> bool:
    """Whether joint 2 is revolute."""
    return waiting.units.get(POINT, "rad") == "rad"


class SignalRow(NamedTuple):
    """State of one signal of a waiting file."""

    words: str
    source: str = ""
    picture: Markup | str = ""
    kind: str = ""
    """Style of the state."""
    evidence: str = ""
    state: str = ""


def _row(waiting: WaitingFile, channel: str) -> SignalRow:
    words, header = waiting.words(channel).removeprefix("the "), waiting.known.get(channel)
    if header is not None:
        entry = waiting.columns.get(channel, {"name": header, "gain": 1.0, "sign": 1})
        factor = entry["gain"] * entry["sign"]
        times = "" if factor == 1.0 else f", × {factor:g}".replace("-", "−")
        return SignalRow(
            words, f"{entry['name']}{times}", _drawn(waiting, header), *_judged(waiting, channel)
        )
    if channel != POINT or waiting.theta2 is None:
        return SignalRow(words, kind="alarm", state="missing")
    value = waiting.theta2
    at = f"{math.degrees(value):g}°" if _turns(waiting) else f"{value:g} m"
    return SignalRow(words, state=f"fixed at {at}")


def _drawn(waiting: WaitingFile, header: str) -> Markup:
    picture = None if waiting.inspection is None else waiting.inspection.pictures.get(header)
    return Markup("") if picture is None else sparkline(*picture, size=PICTURE, title=header)


def _judged(waiting: WaitingFile, channel: str) -> tuple[str, str, str]:
    """Style, evidence and text of the check's cell."""
    wording, inspection = waiting.wording_of(channel), waiting.inspection
    if wording is not None:
        return "alarm", wording[1], title_of(wording[0])
    changed = None if inspection is None else inspection.taken_in.get(channel)
    if changed is not None:
        return "soft", "", with_symbols(changed)
    return "", "", "✓" if inspection is not None else ""


GAPS = {
    "Split into recordings": SPLIT,
    "Interpolate": "interpolate",
    "Fill, but exclude from fit": "mask",
    "Keep the longest part without gaps": "cut",
}
CLOCK = {
    "Interpolate to an even clock": "interpolate",
    "Ignore timestamps": "count",
}
AS_RECORDED = "As recorded"
FAST = 2000.0
"""Hz: the links' modes end below 100 Hz, twenty samples each; above it rows cost time only."""
RATES = {AS_RECORDED: None} | {f"{rate:g} Hz": rate for rate in (5000.0, 2000.0, 1000.0, 500.0)}
"""Of these the ones are offered that are below a log's own."""


class RowChoice(PageElement):
    """Choices about gaps and clock, shown only if the file needs them."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        answer = self.session.recordings.answer
        self._clock = self._dropdown("Uneven time", CLOCK, lambda clock: answer(clock=clock))
        self._gaps = self._dropdown("Gaps", GAPS, lambda gaps: answer(gaps=gaps))
        self._rate = self._dropdown("Sample rate", RATES, lambda rate: answer(rate=rate))

    def _dropdown(
        self, label: str, options: Mapping[str, Any], answer: Callable[[Any], None]
    ) -> Any:
        made: Any = self.gui.add_dropdown(label, tuple(options), visible=False)
        return on_user_input(self.context, made, lambda: answer(options[str(made.value)]))

    def show(self, waiting: WaitingFile) -> None:
        """Shows the choices for these files."""
        self._clock.visible = any(each.uneven for each in waiting.rows)
        set_options(self._clock, tuple(CLOCK), _word(CLOCK, waiting.clock))
        self._gaps.visible = bool(waiting.gaps_chosen)
        set_options(self._gaps, tuple(GAPS), _word(GAPS, waiting.gaps_chosen))
        usual = max(each.rate for each in waiting.rows)
        self._rate.visible = usual > FAST
        lower = tuple(word for word, rate in RATES.items() if rate is None or rate < usual)
        set_options(self._rate, lower, _word(RATES, waiting.rate))


def _word(options: Mapping[str, object], value: object) -> str:
    return next((word for word, choice in options.items() if choice == value), "")
