"""What happens to the rows of a file that waits: uneven ones, missing ones, too many."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from flexgui.panels.page_context import PageContext
from flexgui.panels.words import joined, paragraph
from flexgui.session.columns import Waiting

GAPS = {
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

    def __init__(self, desk: PageContext) -> None:
        self._desk, session = desk, desk.session
        self._clock = self._dropdown(
            "Uneven time", CLOCK, lambda text: session.choose_clock(CLOCK[text])
        )
        self._gaps = self._dropdown("Gaps", GAPS, lambda text: session.choose_gaps(GAPS[text]))
        self._rate = self._dropdown(
            "Sample rate", (AS_RECORDED,), lambda text: session.choose_rate(_rate(text))
        )

    def _dropdown(self, label: str, options: Any, put: Any) -> Any:
        desk = self._desk
        handle: Any = desk.gui.add_dropdown(
            label, tuple(options), disabled=desk.read_only, visible=False
        )

        def chosen(event: Any) -> None:
            if event.client_id is not None:  # not where the page itself has set it
                put(str(handle.value))

        if not desk.read_only:
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
