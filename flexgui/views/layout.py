"""The common look of all figures: clear ground, thin grid, text that a page may recolour."""

from __future__ import annotations

from typing import Any

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
