"""Figures as the report's template needs them."""

from __future__ import annotations

import base64
import gzip
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from markupsafe import Markup
from plotly.offline import get_plotlyjs

from flexgui.views.layout import HEIGHT, Figure, figure_json, plain

if TYPE_CHECKING:
    import plotly.graph_objects as go


def packed(text: str) -> Markup:
    """gzip in base64, safe inside a script element; the same text gives the same bytes."""
    return Markup(base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode("ascii"))


@cache
def packed_plotly() -> Markup:
    """plotly.js; `unpack` of report.js runs it."""
    return packed(get_plotlyjs())


@dataclass(frozen=True)
class Plot:
    """A figure as the template needs it."""

    json: Markup
    height: int
    caption: str


def plot(figure: Figure | go.Figure | None) -> Plot | None:
    """A figure as JSON that is safe inside a script element."""
    if figure is None:
        return None
    drawn = plain(figure)
    text = figure_json(drawn).replace("<", "\\u003c").replace("\u2028", "\\u2028")
    layout = drawn["layout"]
    caption = str(layout.get("meta", {}).get("caption", ""))
    return Plot(Markup(text), int(layout.get("height") or HEIGHT), caption)
