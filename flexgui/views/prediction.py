"""Predicted outputs with the bands in which measurements lie."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexgui.core.recording.channels import channel_kind
from flexgui.core.recording.recording import Recording
from flexgui.sentences.written import channel_symbol, shown_unit
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, band, line, panes, trace

OUTPUT_ROW, AROUND_ROWS = 150, 100
"""px of an output, and of what surrounds all of them."""


def prediction(
    recording: Recording, bands: Mapping[str, tuple[np.ndarray, np.ndarray]],
    units: Mapping[str, str], level: float,
) -> Figure:  # fmt: skip
    """A row per output over time in s; `bands`: output -> lower and upper end (N,), SI, of the
    probability `level`; `units` of outputs that may have several."""
    caption = f"Predicted outputs; {100.0 * level:g} % of the measurements lie in the band."
    rows = [_row(recording, name, *ends, units) for name, ends in bands.items()]
    height = AROUND_ROWS + OUTPUT_ROW * len(rows)
    return panes(rows, axis("time [s]"), caption, height, gap=0.12 / max(len(rows), 1))


def _row(
    recording: Recording, name: str, lower: np.ndarray, upper: np.ndarray, units: Mapping[str, str]
) -> Pane:
    si = units.get(name) or channel_kind(name).units[0]
    unit = shown_unit(recording[name], si)
    top, bottom = (trace(recording.time, values * unit.factor) for values in (upper, lower))
    inside = band(top, bottom, "band", colours.MODEL)
    x, y = trace(recording.time, recording[name] * unit.factor)
    symbol = channel_symbol(name, si)
    middle = line(x, y, "predicted", colours.MODEL, f"{symbol} %{{y:.5g}} {unit.name}")
    return Pane([inside, middle], axis(f"{symbol} [{unit.name or '–'}]", nticks=5))
