"""Measured against modelled outputs of one recording with their residuals, large and small."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import plotly.graph_objects as go

from flexgui.core.results import ChannelComparison, RecordingComparison
from flexgui.sentences.written import ShownUnit, shown_unit
from flexgui.views import colours
from flexgui.views.layout import POINTS, Figure, axis, frame, short, trace
from flexgui.views.names import channel_symbol

HEIGHT_PER_CHANNEL, HEIGHT_OF_FRAME = 330, 100
SIGNAL_SHARE, RESIDUAL_SHARE = 0.64, 0.36

MEASURED_LINE = {"color": colours.MEASURED, "width": 1.6}
MODEL_LINE = {"color": colours.MODEL, "width": 1.4, "dash": "dash"}
RESIDUAL_LINE = {"color": colours.RESIDUAL, "width": 1.0}
GIVEN_LINE = {"color": colours.faded(colours.START, 0.45), "width": 1.0}


def comparison(
    recording: RecordingComparison,
    channels: Sequence[ChannelComparison] | None = None,
    before: RecordingComparison | None = None,
    points: int = POINTS,
) -> go.Figure:
    """Two rows per output (signal and residual) over a shared time axis in s; `before`: what the
    model as given left, pale beside the residual; `points`: of each line at the most.

    Written as plain data: adding traces and axes one by one costs a quarter of a second each
    time that a figure has twenty of them.
    """
    shown = recording.channels if channels is None else tuple(channels)
    height = HEIGHT_OF_FRAME + HEIGHT_PER_CHANNEL * len(shown)
    layout = frame(height, _caption(shown, points)) | {"hovermode": "x unified"}
    layout["xaxis"] = axis("time [s]") | {"anchor": f"y{2 * len(shown)}", "domain": [0.0, 1.0]}
    given = {} if before is None else {c.channel: c for c in before.channels}
    traces: list[dict[str, Any]] = []
    lines_of = [_lines(channel, given.get(channel.channel), points) for channel in shown]
    for k in range(len(shown)):
        rows = _domains(k, len(shown))
        for place, (label, lines) in enumerate(lines_of[k]):
            number = 2 * k + place + 1
            name = f"yaxis{number}" if number > 1 else "yaxis"
            layout[name] = axis(label) | {"anchor": "x", "domain": rows[place]}
            traces += [line | _placing(number, legend=k == 0) for line in lines]
    return go.Figure({"data": traces, "layout": layout}, _validate=False)


def _domains(k: int, count: int) -> tuple[list[float], list[float]]:
    """Heights, as shares of the figure, of an output's signal and residual; the first is on top."""
    gap = 0.10 / (2 * count)
    height = (1.0 - gap * (2 * count - 1)) / count
    top = 1.0 - k * (height + 2.0 * gap)
    middle = top - SIGNAL_SHARE * height
    return [middle, top], [max(middle - gap - RESIDUAL_SHARE * height, 0.0), middle - gap]


def _placing(number: int, legend: bool) -> dict[str, Any]:
    return {"xaxis": "x", "yaxis": f"y{number}" if number > 1 else "y", "showlegend": legend}


def _lines(
    channel: ChannelComparison, before: ChannelComparison | None, points: int
) -> list[tuple[str, list[dict[str, Any]]]]:
    """(axis title, traces) of the signal and of the residual."""
    symbol = channel_symbol(channel.channel, channel.unit)
    signal = shown_unit(np.concatenate([channel.measured, channel.model]), channel.unit)
    counted = np.where(channel.counted, channel.residual, np.nan)
    small = shown_unit(counted, channel.unit)
    line = partial(_line, channel, symbol, points)
    measured = line("measured", channel.measured, signal, MEASURED_LINE)
    model = line("model", channel.model, signal, MODEL_LINE)
    left = [line("residual", counted, small, RESIDUAL_LINE)]
    if before is not None and before.time.shape == channel.time.shape:
        was = np.where(before.counted, before.residual, np.nan)
        left.insert(0, line("residual as given", was, small, GIVEN_LINE))
    return [
        (signal.label(symbol), [measured, model]),
        (small.label(f"Δ{symbol}"), left),
    ]


def _line(
    channel: ChannelComparison,
    symbol: str,
    points: int,
    name: str,
    values: np.ndarray,
    unit: ShownUnit,
    line: dict[str, Any],
) -> dict[str, Any]:
    x, y = trace(channel.time, values * unit.factor, points)
    return {
        "type": "scatter",
        "x": x,
        "y": y,
        "mode": "lines",
        "name": name,
        "line": line,
        "legendgroup": name,
        "hovertemplate": f"{symbol} %{{y:.4g}} {unit.name}",
    }


def _caption(shown: Sequence[ChannelComparison], points: int) -> str:
    text = "Residual: measured minus model, over the samples that count."
    if any(channel.time.size > points for channel in shown):
        text += (
            f" Long traces are drawn with about {points} points, the least and the greatest value "
            "of each stretch; the tables hold every sample."
        )
    return text


SMALL_POINTS = 500
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
        data += _small_rows(channel, k, len(channels), layout)
    return {"data": data, "layout": layout}


def _small_rows(channel: ChannelComparison, k: int, count: int, layout: Figure) -> list[Figure]:
    symbol = channel_symbol(channel.channel, channel.unit)
    signal = shown_unit(np.concatenate([channel.measured, channel.model]), channel.unit)
    left = np.where(channel.counted, channel.residual, np.nan)
    small = shown_unit(left, channel.unit)
    height, gap = 1.0 / count, 0.035
    top = 1.0 - k * height
    middle = top - SIGNAL * (height - gap)
    places = (([middle, top], signal.label(symbol)),
              ([top - height + gap, middle - gap], small.label(f"{symbol} error")))  # fmt: skip
    for row, (domain, label) in enumerate(places):
        number = 2 * k + row + 1
        layout[f"yaxis{number if number > 1 else ''}"] = axis(label) | {
            "anchor": "x", "domain": domain, "nticks": TICKS[row],
        }  # fmt: skip
    first, second = 2 * k + 1, 2 * k + 2
    return [
        _small_line(channel, channel.measured, "measured", MEASURED_LINE, signal, first),
        _small_line(channel, channel.model, "model", MODEL_LINE, signal, first),
        _small_line(channel, left, "residual", RESIDUAL_LINE, small, second),
    ]


def _small_line(
    channel: ChannelComparison, values: np.ndarray, name: str, line: dict[str, Any],
    unit: ShownUnit, number: int,
) -> Figure:  # fmt: skip
    x, y = trace(channel.time, values * unit.factor, SMALL_POINTS)
    return {
        "type": "scatter", "mode": "lines", "x": short(x), "y": short(y), "name": name,
        "line": line, "xaxis": "x", "yaxis": f"y{number if number > 1 else ''}",
        "legendgroup": name, "showlegend": number <= 2,
        "hovertemplate": f"{name} %{{y:.4g}} {unit.name}<extra></extra>",
    }  # fmt: skip
