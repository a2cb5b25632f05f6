"""What the model leaves of a recording, with what an effect predicts of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexgui.views import colours
from flexgui.views.layout import axis, frame
from flexgui.views.live import Figure, short
from flexgui.views.names import channel_symbol


def live_prediction(
    channels: Sequence[str],
    dt: float,
    residual: np.ndarray,
    predicted: np.ndarray | None,
    effect: str,
    title: str,
) -> Figure:
    """A row per output, (rows, channels) in floors; the band is one floor wide each way."""
    count = len(channels)
    layout: Figure = frame(400, "") | {"hovermode": "x unified"}
    layout["font"] = {**layout["font"], "size": 11}
    layout["title"] = {
        "text": title, "x": 0.01, "xanchor": "left", "y": 0.985, "yanchor": "top",
        "font": {"size": 12},
    }  # fmt: skip
    layout["xaxis"] = axis("time [s]") | {"anchor": f"y{count if count > 1 else ''}"}
    time = dt * np.arange(len(residual))
    data: list[Figure] = []
    for k, name in enumerate(channels):
        number = "" if k == 0 else str(k + 1)
        top = 1.0 - k / count
        layout[f"yaxis{number}"] = axis(f"Δ{channel_symbol(name)}") | {
            "anchor": "x", "domain": [top - 1.0 / count + 0.03, top],
        }  # fmt: skip
        data.append(_line(time, residual[:, k], "residual", colours.RESIDUAL, 1.0, number))
        if predicted is not None:
            data.append(_line(time, predicted[:, k], effect, colours.ADDED, 1.6, number, "dash"))
    layout["shapes"] = [_band(k) for k in range(count)]
    return {"data": data, "layout": layout}


def _line(
    x: np.ndarray,
    y: np.ndarray,
    name: str,
    colour: str,
    width: float,
    number: str,
    dash: str = "solid",
) -> Figure:
    return {
        "type": "scatter", "mode": "lines", "x": short(x), "y": short(y), "name": name,
        "xaxis": "x", "yaxis": f"y{number}", "legendgroup": name, "showlegend": number == "",
        "line": {"color": colour, "width": width, "dash": dash},
        "hovertemplate": f"{name} %{{y:.3g}} × noise floor<extra></extra>",
    }  # fmt: skip


def _band(k: int) -> Figure:
    number = "" if k == 0 else str(k + 1)
    return {
        "type": "rect", "xref": "paper", "yref": f"y{number}", "x0": 0, "x1": 1, "y0": -1, "y1": 1,
        "fillcolor": colours.faded(colours.START, 0.22), "line": {"width": 0}, "layer": "below",
    }  # fmt: skip
