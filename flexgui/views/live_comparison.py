"""Measured, model and residual of one recording, small enough to be redrawn while it plays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from core.results import ChannelComparison, RecordingComparison
from core.written import ShownUnit, shown_unit
from flexgui.views.comparison import MEASURED_LINE, MODEL_LINE, RESIDUAL_LINE
from flexgui.views.decimate import trace
from flexgui.views.layout import axis, frame
from flexgui.views.live import Figure, short
from flexgui.views.names import channel_symbol

POINTS = 500
TICKS = (5, 3)
"""Numbers on the axes of a signal and of its error, at most: more overlap in a low row."""
SIGNAL = 0.58
"""Share of an output's room that its signal takes; the residual has the rest."""


def live_comparison(recording: RecordingComparison, names: Sequence[str]) -> Figure:
    """Two rows per output over a shared time axis in s."""
    channels = [c for c in recording.channels if c.channel in names]
    rows = 2 * len(channels)
    layout: Figure = frame(500, "") | {"hovermode": "x unified"}
    layout["font"] = {**layout["font"], "size": 11}
    layout["xaxis"] = axis("time [s]") | {"anchor": f"y{rows}"}
    data: list[Figure] = []
    for k, channel in enumerate(channels):
        data += _rows(channel, k, len(channels), layout)
    return {"data": data, "layout": layout}


def _rows(channel: ChannelComparison, k: int, count: int, layout: Figure) -> list[Figure]:
    symbol = channel_symbol(channel.channel, channel.unit)
    signal = shown_unit(np.concatenate([channel.measured, channel.model]), channel.unit)
    left = np.where(channel.counted, channel.residual, np.nan)
    small = shown_unit(left, channel.unit)
    room, gap = 1.0 / count, 0.035
    top = 1.0 - k * room
    middle = top - SIGNAL * (room - gap)
    places = (([middle, top], signal.label(symbol)),
              ([top - room + gap, middle - gap], small.label(f"{symbol} error")))  # fmt: skip
    for row, (domain, label) in enumerate(places):
        number = 2 * k + row + 1
        layout[f"yaxis{number if number > 1 else ''}"] = axis(label) | {
            "anchor": "x", "domain": domain, "nticks": TICKS[row],
        }  # fmt: skip
    first, second = 2 * k + 1, 2 * k + 2
    return [
        _line(channel, channel.measured, "measured", MEASURED_LINE, signal, first),
        _line(channel, channel.model, "model", MODEL_LINE, signal, first),
        _line(channel, left, "residual", RESIDUAL_LINE, small, second),
    ]


def _line(
    channel: ChannelComparison, values: np.ndarray, name: str, line: dict[str, Any],
    unit: ShownUnit, number: int,
) -> Figure:  # fmt: skip
    x, y = trace(channel.time, values * unit.factor, POINTS)
    return {
        "type": "scatter", "mode": "lines", "x": short(x), "y": short(y), "name": name,
        "line": line, "xaxis": "x", "yaxis": f"y{number if number > 1 else ''}",
        "legendgroup": name, "showlegend": number <= 2,
        "hovertemplate": f"{name} %{{y:.4g}} {unit.name}<extra></extra>",
    }  # fmt: skip
