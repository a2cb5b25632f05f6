"""Figures for a small panel beside the arm: little margin, one line of legend, built in a moment.

They are written as plain data: Plotly's own checks cost more than all the rest, and these are
drawn with every move of a slider.
"""

from __future__ import annotations

from typing import Any

import plotly.graph_objects as go

from flexgui.views.layout import axis, frame

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
) -> go.Figure:
    """Traces over one pair of axes; `x` and `y` come from `small_axis`."""
    whole = frame(HEIGHT, caption) | {
        "margin": MARGIN,
        "xaxis": x,
        "yaxis": y,
        "uirevision": "keep",
    }
    whole["template"] = {}  # by name it would only be understood by the checks left out here
    whole["font"] = whole["font"] | {"size": FONT_SIZE}
    return go.Figure({"data": traces, "layout": whole | layout}, _validate=False)


def small_axis(text: str, **more: Any) -> dict[str, Any]:
    """The look of one axis."""
    look = axis(text)
    look["title"] = look["title"] | {"standoff": 4}
    return look | more
