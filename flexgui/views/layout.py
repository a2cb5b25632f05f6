"""The common look of all figures: clear ground, thin grid, text that a page may recolour.

Small figures are plain dictionaries, as `go.Figure` takes them: Plotly's own objects cost more
than all the rest, and these are drawn with every move of a slider.
"""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import plotly.graph_objects as go

from flexgui.views import colours

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', sans-serif"


def styled(figure: go.Figure, height: int, caption: str, **layout: Any) -> go.Figure:
    """The figure in the house's look; `caption` travels in `layout.meta`."""
    figure.update_layout(**frame(height, caption), **layout)
    figure.update_xaxes(**axis())
    figure.update_yaxes(**axis())
    return figure


def frame(height: int, caption: str) -> dict[str, Any]:
    """The look of a whole figure, as a layout."""
    return {
        "template": "none",
        "height": height,
        "meta": {"caption": caption},
        "paper_bgcolor": colours.CLEAR,
        "plot_bgcolor": colours.CLEAR,
        "font": {"family": FONT, "size": 13, "color": colours.TEXT},
        "margin": {"l": 64, "r": 12, "t": 36, "b": 48},
        # On the left: the buttons of a figure stand on the right, on a touch screen all the time.
        "legend": {"orientation": "h", "x": 0, "y": 1, "yanchor": "bottom", "xanchor": "left"},
        "modebar": {"bgcolor": colours.CLEAR, "color": colours.START, "activecolor": colours.START},
        "hoverlabel": {
            "bgcolor": colours.HOVER_BACKGROUND,
            "font": {"color": colours.HOVER_TEXT, "family": FONT},
        },
    }


def axis(text: str = "") -> dict[str, Any]:
    """The look of one axis."""
    title: dict[str, Any] = {"standoff": 8}
    if text:
        title["text"] = text
    return {
        "gridcolor": colours.GRID,
        "linecolor": colours.AXIS,
        "tickcolor": colours.AXIS,
        "ticks": "outside",
        "ticklen": 4,
        "zeroline": False,
        "showline": True,
        "title": title,
    }


def caption(figure: go.Figure) -> str:
    """The caption that `styled` stored."""
    meta = figure.layout.meta or {}
    return str(meta.get("caption", ""))


def title(figure: go.Figure, row: int, text: str, axis: str = "y") -> None:
    """Name the axis of one row of subplots."""
    update = figure.update_yaxes if axis == "y" else figure.update_xaxes
    update(title_text=text, row=row, col=1)


Figure = dict[str, Any]


def figure(traces: list[Figure], x: Figure, y: Figure, title: str = "", **layout: Any) -> Figure:
    """A figure in the house's look with one pair of axes."""
    base = frame(260, "") | {"xaxis": x, "yaxis": y, "font": {**frame(0, "")["font"], "size": 11}}
    if title:
        base["title"] = {
            "text": title, "x": 0.01, "xanchor": "left", "y": 0.985, "yanchor": "top",
            "font": {"size": 12},
        }  # fmt: skip
    return {"data": traces, "layout": base | layout}


def ax(text: str, **more: Any) -> Figure:
    """One axis."""
    return axis(text) | {"title": {"text": text, "standoff": 4}} | more


def line(x: np.ndarray, y: np.ndarray, name: str, colour: str, **more: Any) -> Figure:
    """A line through points."""
    width, dash = more.pop("width", 1.6), more.pop("dash", "solid")
    return {
        "type": "scatter", "mode": "lines", "x": short(x), "y": short(y), "name": name,
        "line": {"color": colour, "width": width, "dash": dash},
    } | more  # fmt: skip


def dots(x: np.ndarray, y: np.ndarray, name: str, colour: str, **marker: Any) -> Figure:
    """Points."""
    return {
        "type": "scatter", "mode": "markers", "x": short(x), "y": short(y), "name": name,
        "marker": {"color": colour, "size": 7} | marker,
    }  # fmt: skip


def short(values: np.ndarray) -> np.ndarray:
    """As exact as a pixel can show; what is not finite is a gap."""
    found = np.asarray(values, dtype=np.float32)
    return np.where(np.isfinite(found), found, np.float32(np.nan))


HEIGHT = 260
"""px, for a panel about 560 px wide."""

MARGIN = {"l": 68, "r": 12, "t": 24, "b": 38}
FONT_SIZE = 12


def small_figure(
    traces: list[dict[str, Any]],
    x: dict[str, Any],
    y: dict[str, Any],
    caption: str,
    **layout: Any,
) -> Figure:
    """Traces over one pair of axes; `x` and `y` come from `small_axis`."""
    whole = frame(HEIGHT, caption) | {
        "margin": MARGIN,
        "xaxis": x,
        "yaxis": y,
        "uirevision": "keep",
    }
    whole["template"] = {}  # the name of one is only understood by Plotly's objects
    whole["font"] = whole["font"] | {"size": FONT_SIZE}
    return {"data": traces, "layout": whole | layout}


def small_axis(text: str, **more: Any) -> dict[str, Any]:
    """The look of one axis."""
    look = axis(text)
    look["title"] = look["title"] | {"standoff": 4}
    return look | more


POINTS = 2000
"""Enough for a plot 2000 pixels wide; more only makes the report heavy."""
GAP = 5.0
"""A pause longer than this many usual steps breaks the line."""


def decimate(time: np.ndarray, values: np.ndarray, points: int = POINTS) -> np.ndarray:
    """Indices (k,), k <= points, that keep the least and the greatest finite value per stretch."""
    index = np.flatnonzero(np.isfinite(values) & np.isfinite(time))
    if index.size <= points:
        return index
    width = -(-index.size // (points // 2))
    padded = np.concatenate([index, np.repeat(index[-1:], -index.size % width)])
    stretches = padded.reshape(-1, width)
    inside = values[stretches]
    rows = np.arange(len(stretches))
    least = stretches[rows, np.argmin(inside, axis=1)]
    greatest = stretches[rows, np.argmax(inside, axis=1)]
    return np.unique(np.concatenate([least, greatest]))


def trace(
    time: np.ndarray, values: np.ndarray, points: int = POINTS
) -> tuple[np.ndarray, np.ndarray]:
    """A line to draw, float32: decimated, and broken (NaN) where samples are missing for long."""
    present = np.flatnonzero(np.isfinite(values) & np.isfinite(time))
    index = decimate(time, values, points)
    x, y = time[index].astype(np.float32), values[index].astype(np.float32)
    if index.size < 2:
        return x, y
    steps = np.diff(time[present])
    starts = present[np.flatnonzero(steps > GAP * np.median(steps))]
    breaks = np.unique(np.searchsorted(index, starts, side="right"))
    breaks = breaks[(breaks > 0) & (breaks < index.size)]
    return np.insert(x, breaks, x[breaks - 1]), np.insert(y, breaks, np.float32(np.nan))


TYPES = {"f": np.dtype("<f4"), "i": np.dtype("<i4")}
"""Kind of number -> how it travels: seven digits are more than a pixel shows."""


def figure_json(value: Any) -> str:
    """JSON of a figure or a part of one; vectors as {dtype, bdata}, NaN (a gap) as null."""
    return _ENCODER.encode(value).decode()


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a figure holds no {type(value).__name__}")
    kind = TYPES.get(value.dtype.kind)
    if kind is None or value.ndim != 1:
        return value.tolist()
    return {"dtype": kind.str[1:], "bdata": value.astype(kind).tobytes()}


_ENCODER = msgspec.json.Encoder(enc_hook=_plain)
