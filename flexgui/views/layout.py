"""Builds all figures: axes, lines, panes and one style that a page can recolour.

A figure is plain data, as Plotly takes it: Plotly's own objects cost more than all the rest, and
some figures are drawn with every move of a slider.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec
import numpy as np

from flexgui.views import colours

if TYPE_CHECKING:
    import plotly.graph_objects as go

FONT = "-apple-system, BlinkMacSystemFont, 'Segoe UI', Roboto, Helvetica, Arial, sans-serif"
PANEL_HEIGHT = 260
"""px, for a panel about 560 px wide."""

Figure = dict[str, Any]
"""{'data': traces, 'layout': …}, or a part of it."""

Curve = tuple[np.ndarray, np.ndarray]
"""x and y (N,)"""


def frame(height: int, caption: str) -> Figure:
    """Layout of a whole figure; the caption is stored in `meta`."""
    return {
        "template": {},
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


def axis(text: str = "", **more: Any) -> Figure:
    """One axis with its title."""
    return {
        "gridcolor": colours.GRID,
        "linecolor": colours.AXIS,
        "tickcolor": colours.AXIS,
        "ticks": "outside",
        "ticklen": 4,
        "zeroline": False,
        "showline": True,
        "title": {"text": text, "standoff": 5},
        **more,
    }


def named_axis(names: Sequence[str], text: str = "", **more: Any) -> Figure:
    """An axis with names at 0, 1, 2, …"""
    ticks = {"tickvals": list(range(len(names))), "ticktext": list(names)}
    return axis(text, **ticks, **more)


def figure(
    traces: Sequence[Figure],
    x: Figure,
    y: Figure,
    caption: str = "",
    height: int = PANEL_HEIGHT,
    **layout: Any,
) -> Figure:
    """Traces over one pair of axes."""
    return {
        "data": list(traces),
        "layout": frame(height, caption) | {"xaxis": x, "yaxis": y} | layout,
    }


class Pane(NamedTuple):
    """One pair of axes among several."""

    traces: Sequence[Figure]
    y: Figure
    x: Figure | None = None
    """None where all panes share one."""
    share: float = 1.0
    """Of the room, against those of the others."""
    title: str = ""
    """Above it."""


def panes(
    parts: Sequence[Pane],
    x: Figure | None = None,
    caption: str = "",
    height: int = PANEL_HEIGHT,
    gap: float = 0.05,
    columns: int = 1,
    below: float = 0.0,
    **layout: Any,
) -> Figure:
    """Panes in rows from the top, each from the left; a name is in the legend only once.

    Args:
        parts: Those of several columns are equally large and have axes of their own.
        x: The axis that all of them share, below the last.
        caption: Of the whole figure.
        height: px
        gap: Between two panes of a row, or of one column, as a share of the figure.
        columns: Panes side by side.
        below: Between rows of several columns, as a share of the figure.
        layout: More of Plotly's layout.
    """
    whole, data, named = frame(height, caption), list[Figure](), set[str | None]()
    notes: list[Figure] = []
    if x is not None:
        whole["xaxis"] = x | {"anchor": f"y{number(len(parts) - 1)}"}
    for k, (part, place) in enumerate(zip(parts, _places(parts, gap, columns, below), strict=True)):
        own = "" if part.x is None else number(k)
        whole[f"yaxis{number(k)}"] = part.y | {"anchor": f"x{own}", "domain": place.up}
        if part.x is not None:
            whole[f"xaxis{own}"] = part.x | {"anchor": f"y{number(k)}", "domain": place.across}
        for trace in part.traces:
            name = trace.get("name")
            legend = {"legendgroup": name, "showlegend": name not in named} if name else {}
            data.append(legend | trace | {"xaxis": f"x{own}", "yaxis": f"y{number(k)}"})
            named.add(name)
        if part.title:
            notes.append(note(part.title, place.across[0], place.up[1], size=13))
    return {"data": data, "layout": whole | {"annotations": notes} | layout}


def number(k: int) -> str:
    """Plotly's name of the k-th axis, from 0."""
    return "" if k == 0 else str(k + 1)


class _Place(NamedTuple):
    """Begin and end of a pane on either axis, as shares of the figure."""

    across: list[float]
    up: list[float]


def _places(parts: Sequence[Pane], gap: float, columns: int, below: float) -> list[_Place]:
    single = columns == 1
    rows = [part.share for part in parts] if single else [1.0] * -(-len(parts) // columns)
    across = _spans([1.0] * columns, gap)
    up = [[1.0 - end, 1.0 - begin] for begin, end in _spans(rows, gap if single else below)]
    return [_Place(across[k % columns], up[k // columns]) for k in range(len(parts))]


def _spans(shares: Sequence[float], gap: float) -> list[list[float]]:
    free = (1.0 - gap * (len(shares) - 1)) / sum(shares)
    spans, begin = [], 0.0
    for share in shares:
        end = min(begin + free * share, 1.0)
        spans.append([begin, end])
        begin = end + gap
    return spans


def line(x: Any, y: Any, name: str, colour: str, hover: str = "", **more: Any) -> Figure:
    """A line; arrays become float32. `more`: width, dash and other properties of a trace."""
    stroke = {"color": colour, "width": more.pop("width", 1.6), "dash": more.pop("dash", "solid")}
    return _points(x, y, name, hover) | {"mode": "lines", "line": stroke, **more}


def band(
    upper: Curve, lower: Curve, name: str, colour: str, opacity: float = 0.25, **more: Any
) -> Figure:
    """What lies between two curves, in a colour of an `opacity` between 0 and 1."""
    x, y = (np.concatenate([a, b[::-1]]) for a, b in zip(upper, lower, strict=True))
    shade = {"fill": "toself", "fillcolor": colours.faded(colour, opacity), "hoverinfo": "skip"}
    return line(x, y, name, colour, width=0, **shade, **more)


def dots(x: Any, y: Any, name: str, colour: str, hover: str = "", **marker: Any) -> Figure:
    """A trace of points."""
    style = {"color": colour, "size": 7, **marker}
    return _points(x, y, name, hover) | {"mode": "markers", "marker": style}


def _points(x: Any, y: Any, name: str, hover: str) -> Figure:
    """A trace; without a name it is not in the legend."""
    legend = {"name": name} if name else {"showlegend": False}
    shown = {"hovertemplate": hover} if hover else {}
    return {"type": "scatter", "x": short(x), "y": short(y), **legend, **shown}


def heat(z: np.ndarray, scale: Sequence[tuple[float, str]], title: str, **more: Any) -> Figure:
    """A heat map of z (rows, columns) with cells at 0, 1, 2, …"""
    bar = {"title": {"text": title, "side": "right"}, "thickness": 12} | more.pop("colorbar", {})
    rows, columns = z.shape
    return {
        "type": "heatmap", "z": z, "x": list(range(columns)), "y": list(range(rows)),
        "colorscale": [list(stop) for stop in scale], "colorbar": bar, **more,
    }  # fmt: skip


def short(values: Any) -> Any:
    """float32 values, in which a non-finite value is a gap; lists stay as they are."""
    if isinstance(values, list):
        return values
    array = np.asarray(values, dtype=np.float32)
    return np.where(np.isfinite(array), array, np.float32(np.nan))


def note(text: str, x: float, y: float, size: int = 11, yanchor: str = "bottom") -> Figure:
    """Text at a place of the figure, x and y in shares of its width and height."""
    return {
        "text": text, "xref": "paper", "yref": "paper", "x": x, "y": y, "xanchor": "left",
        "yanchor": yanchor, "showarrow": False, "font": {"size": size, "color": colours.TEXT},
    }  # fmt: skip


def headline(text: str) -> Figure:
    """A title on the left, as a part of a layout."""
    place = {"x": 0.01, "xanchor": "left", "y": 0.985, "yanchor": "top"}
    return {"text": text, "font": {"size": 12}, **place}


def plain(figure: Figure | go.Figure) -> Figure:
    """Plain data of a figure, also of Plotly's own objects."""
    return figure if isinstance(figure, dict) else figure.to_plotly_json()


def with_height(drawn: Figure | go.Figure) -> Figure:
    """Plain data of a figure with a height and a caption, which Plotly's own may lack."""
    figure = plain(drawn)
    return figure | {"layout": {"height": PANEL_HEIGHT, "meta": {"caption": ""}} | figure["layout"]}


MOST_POINTS = 2000
"""Enough for a plot 2000 pixels wide; more only makes the report heavy."""
LONGEST_PAUSE = 5.0
"""A pause longer than this many usual steps breaks the line."""


def decimate(time: np.ndarray, values: np.ndarray, points: int = MOST_POINTS) -> np.ndarray:
    """Indices (k,), k <= points, that keep minimum and maximum of each interval of `values` (N,)
    over `time` (N,)."""
    index = np.flatnonzero(np.isfinite(values) & np.isfinite(time))
    if index.size <= points:
        return index
    width = -(-index.size // (points // 2))
    padded = np.concatenate([index, np.repeat(index[-1:], -index.size % width)])
    stretches = padded.reshape(-1, width)
    inside = values[stretches]
    rows = np.arange(len(stretches))
    lowest = stretches[rows, np.argmin(inside, axis=1)]
    greatest = stretches[rows, np.argmax(inside, axis=1)]
    return np.unique(np.concatenate([lowest, greatest]))


def trace(
    time: np.ndarray, values: np.ndarray, points: int = MOST_POINTS
) -> tuple[np.ndarray, np.ndarray]:
    """A line to draw, float32, of `values` (N,) over `time` (N,): decimated, and broken (NaN) where
    samples are missing for long."""
    present = np.flatnonzero(np.isfinite(values) & np.isfinite(time))
    index = decimate(time, values, points)
    x, y = time[index].astype(np.float32), values[index].astype(np.float32)
    if index.size < 2:
        return x, y
    steps = np.diff(time[present])
    starts = present[np.flatnonzero(steps > LONGEST_PAUSE * np.median(steps))]
    breaks = np.unique(np.searchsorted(index, starts, side="right"))
    breaks = breaks[(breaks > 0) & (breaks < index.size)]
    return np.insert(x, breaks, x[breaks - 1]), np.insert(y, breaks, np.float32(np.nan))


TYPES = {"f": np.dtype("<f4"), "i": np.dtype("<i4")}
"""Kind of number -> how it travels: seven digits are more than a pixel shows."""


def figure_json(value: Any) -> str:
    """JSON of a figure or a part of one; vectors as {dtype, bdata}, NaN (a gap) as null."""
    return _ENCODER.encode(value).decode()


def plain_value(value: Any) -> Any:
    """What JSON lacks, as JSON: a number of NumPy, or an array; TypeError for anything else."""
    if isinstance(value, np.generic):
        return value.item()
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a figure holds no {type(value).__name__}")
    kind = TYPES.get(value.dtype.kind)
    if kind is None or value.ndim != 1:
        return value.tolist()
    return {"dtype": kind.str[1:], "bdata": value.astype(kind).tobytes()}


_ENCODER = msgspec.json.Encoder(enc_hook=plain_value)
