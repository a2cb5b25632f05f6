"""Charts of lines over one common axis for uPlot, which draws ten times as fast as Plotly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexgui.views import colours
from flexgui.views.layout import FONT, Figure

TICKS, LABELS = f"12px {FONT}", f"14px {FONT}"
"""The same as Plotly's."""
AXIS_SIZE = {"x": 28, "y": 48}
"""px for the numbers of an axis."""
LABEL_SIZE = 19
DASHES = {"solid": [], "dash": [8, 5], "dot": [2, 4]}
STROKES = {"solid": "━", "dash": "╍", "dot": "┉"}
"""Before the name; `browser/page.js` makes a line of it, as uPlot's legend has squares."""
LARGEST_DRAWN = 1e30
"""More has no axis: uPlot would look for its numbers for ever."""
NO_LINE = [0, 100_000]
"""A dash that never comes: without a width the legend would show no colour."""
FAINT = "rgba(128,136,146,0.11)"
"""A logarithmic axis has nine lines per decade."""


@dataclass(frozen=True)
class Chart:
    """Data and style of one chart; `look` stays the same while only the numbers change."""

    data: tuple[np.ndarray, ...]
    """(N,) each, float64: x, then y of each series; NaN: no point."""
    look: dict[str, Any]
    """series, scales, axes"""


def chart(figure: Figure, dark: bool = False) -> Chart:
    """A chart from a figure whose lines share their x values.

    What is below the least of a logarithmic axis runs along it; a gap there is no point at all.
    `dark`: for a dark ground.
    """
    traces, layout = figure["data"], figure["layout"]
    x = _decimals(max((t["x"] for t in traces), key=len))
    lowest = _least(layout["yaxis"])
    columns = [_column(trace, x, lowest) for trace in traces]
    if np.isfinite(lowest):  # uPlot takes what is no number for the lower end of such an axis
        drawn = np.isfinite(columns).all(axis=0)
        x, columns = x[drawn], [column[drawn] for column in columns]
    axes = {key: layout[f"{key}axis"] for key in ("x", "y")}
    style = {
        "series": (
            {"label": axes["x"]["title"]["text"]}, *(_series(trace) for trace in traces)
        ),
        "scales": {key: _scale(axis) for key, axis in axes.items()},
        "axes": tuple(_axis(key, axis, dark) for key, axis in axes.items()),
    }  # fmt: skip
    return Chart((x, *columns), style)


def _decimals(x: Any) -> np.ndarray:
    """(N,) with the fewest digits that single precision needs: 0.1, not 0.10000000149.

    Else a logarithmic axis begins below the data, at 0.09. viser moves its ends in proportion to
    those of the data, so a longer axis would begin below zero, where uPlot counts for ever.
    """
    return np.asarray(x, dtype=np.float32).astype(str).astype(float)


def _column(trace: Figure, x: np.ndarray, lowest: float) -> np.ndarray:
    """(N,)"""
    values = np.asarray(trace["y"], dtype=float)
    values = np.where(np.abs(values) < LARGEST_DRAWN, values, np.nan)
    if len(values) < len(x):
        nearest = np.searchsorted(0.5 * (x[1:] + x[:-1]), trace["x"])  # theirs may be rounded
        values, few = np.full(len(x), np.nan), values
        values[nearest] = few
    return np.maximum(values, lowest)


def _least(axis: Figure) -> float:
    if axis.get("type") == "log" and "range" in axis:
        return float(10.0 ** axis["range"][0])
    return -np.inf


def _series(trace: Figure) -> dict[str, Any]:
    if trace["mode"] == "markers":
        colour, size = trace["marker"]["color"], trace["marker"]["size"]
        points = {"show": True, "size": size + 1, "fill": colour, "stroke": colour, "width": 0}
        name = f"• {trace['name']}"
        return {"label": name, "stroke": colour, "width": 1, "dash": NO_LINE, "points": points}
    line = trace["line"]
    return {
        "label": f"{STROKES[line['dash']]} {trace['name']}",
        "stroke": line["color"],
        "width": line["width"],
        "dash": DASHES[line["dash"]],
        "points": {"show": False},
    }


def _scale(axis: Figure) -> dict[str, Any]:
    return {"time": False, "distr": 3 if axis.get("type") == "log" else 1}


def _axis(key: str, axis: Figure, dark: bool) -> dict[str, Any]:
    return {
        "label": axis["title"]["text"],
        "labelSize": LABEL_SIZE,
        "labelFont": LABELS,
        "size": AXIS_SIZE[key],
        "font": TICKS,
        "stroke": colours.TEXT_ON_DARK if dark else colours.TEXT,
        "grid": {"stroke": FAINT if axis.get("type") == "log" else colours.GRID, "width": 1},
        "ticks": {"stroke": colours.AXIS, "width": 1, "size": 4},
    }
