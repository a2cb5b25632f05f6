"""A Plotly panel that is cheap to update."""

from __future__ import annotations

import json
from typing import Any

import plotly.graph_objects as go
import viser

from flexgui.views.preview import cursor_shape

EMPTY: dict[str, Any] = {"data": [], "layout": {}}
MARGIN = {"l": 60, "r": 10, "t": 28, "b": 40}
CONFIG = {"displayModeBar": False}


class Plot:
    """One figure; hidden where there is nothing to draw."""

    def __init__(self, gui: viser.GuiApi, aspect: float, title: str = "") -> None:
        """`aspect` is height over width; `title` for figures that have none."""
        self._title = title
        self._handle = gui.add_plotly(
            go.Figure(EMPTY, _validate=False), aspect=aspect, visible=False
        )
        self._before, self._shapes, self._after = "", "", ""

    def show(self, figure: go.Figure | dict[str, Any] | None, cursor: float | None = None) -> None:
        """Draws a figure (or its dict), with the time-line's cursor in s; None hides the plot."""
        if figure is None:
            self._handle.visible = False
            return
        if isinstance(figure, go.Figure):
            figure = json.loads(figure.to_json())
        layout = dict(figure["layout"])
        shapes = layout.pop("shapes", [])
        layout |= {"margin": MARGIN, "height": None}
        if self._title:
            layout |= titled(self._title, layout)
        # The cursor is put into the finished text: moving it costs no serialisation.
        text = _text({"data": figure["data"], "config": CONFIG, "layout": layout})
        self._before = text[:-2] + ',"shapes":['
        self._shapes = ",".join(_text(shape) for shape in shapes)
        self._after = "]}}"
        self.move_cursor(cursor)
        self._handle.visible = True

    def move_cursor(self, cursor: float | None) -> None:
        """The same figure with the cursor elsewhere."""
        if not self._before:
            return
        line = _text(cursor_shape(cursor)) if cursor is not None else ""
        shapes = ",".join(part for part in (self._shapes, line) if part)
        self._handle._plotly_json_str = self._before + shapes + self._after


def titled(title: str, layout: dict[str, Any]) -> dict[str, Any]:
    """The title on the left, the legend on the right of one line (left of a note there)."""
    legend = layout.get("legend", {})
    place = {"x": 0.01, "xanchor": "left", "y": 0.985, "yanchor": "top"}
    beside = {"x": 1.0, "xanchor": "right", "font": {"size": 10}}
    if layout.get("annotations"):
        beside |= {"x": 0.0, "xanchor": "left"}
    return {
        "title": {"text": title, "font": {"size": 12}} | place,
        "legend": legend | beside,
    }


def _text(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)
