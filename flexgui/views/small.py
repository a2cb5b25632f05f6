"""Figures for a small panel beside the arm: little margin, one line of legend, built in a moment.

They are plain dictionaries, as `go.Figure` takes them: Plotly's own objects cost more than all
the rest, and these are drawn with every move of a slider.
"""

from __future__ import annotations

from typing import Any

from flexgui.views.layout import axis, frame
from flexgui.views.live import Figure

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
