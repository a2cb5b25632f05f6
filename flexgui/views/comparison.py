"""Measured against modelled outputs of one recording, each with its residual below it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from core.results import ChannelComparison, RecordingComparison
from flexgui.views import colours
from flexgui.views.decimate import POINTS, trace
from flexgui.views.layout import styled, title
from flexgui.views.names import channel_symbol
from flexgui.views.units import shown_unit

HEIGHT_PER_CHANNEL, HEIGHT_OF_FRAME = 330, 100
SIGNAL_SHARE, RESIDUAL_SHARE = 0.64, 0.36


def comparison(
    recording: RecordingComparison, channels: Sequence[ChannelComparison] | None = None
) -> go.Figure:
    """Two rows per output (signal and residual) over a shared time axis in s."""
    shown = recording.channels if channels is None else tuple(channels)
    rows = 2 * len(shown)
    figure = make_subplots(
        rows=rows,
        cols=1,
        shared_xaxes=True,
        vertical_spacing=0.10 / rows,
        row_heights=[SIGNAL_SHARE, RESIDUAL_SHARE] * len(shown),
    )
    for k, channel in enumerate(shown):
        _add_channel(figure, channel, row=2 * k + 1, legend=k == 0)
    figure.update_xaxes(title_text="time [s]", row=rows, col=1)
    height = HEIGHT_OF_FRAME + HEIGHT_PER_CHANNEL * len(shown)
    return styled(figure, height, _caption(shown), hovermode="x unified")


def _add_channel(figure: go.Figure, channel: ChannelComparison, row: int, legend: bool) -> None:
    symbol = channel_symbol(channel.channel)
    signal = shown_unit(np.concatenate([channel.measured, channel.model]), channel.unit)
    counted = np.where(channel.counted, channel.residual, np.nan)
    small = shown_unit(counted, channel.unit)
    for name, values, unit, line, place in (
        ("measured", channel.measured, signal, {"color": colours.MEASURED, "width": 1.6}, row),
        (
            "model",
            channel.model,
            signal,
            {"color": colours.MODEL, "width": 1.4, "dash": "dash"},
            row,
        ),
        ("residual", counted, small, {"color": colours.RESIDUAL, "width": 1.0}, row + 1),
    ):
        x, y = trace(channel.time, values * unit.factor)
        figure.add_scatter(
            x=x,
            y=y,
            mode="lines",
            name=name,
            line=line,
            legendgroup=name,
            showlegend=legend,
            hovertemplate=f"{symbol} %{{y:.4g}} {unit.name}",
            row=place,
            col=1,
        )
    title(figure, row, signal.label(symbol))
    title(figure, row + 1, small.label(f"Δ{symbol}"))


def _caption(shown: Sequence[ChannelComparison]) -> str:
    text = "Residual: measured minus model, over the samples that count."
    if any(channel.time.size > POINTS for channel in shown):
        text += (
            f" Long traces are drawn with about {POINTS} points, the least and the greatest value "
            "of each stretch; the tables hold every sample."
        )
    return text
