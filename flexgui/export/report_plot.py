"""Figures as the report's template needs them."""

from __future__ import annotations

import base64
import gzip
from dataclasses import dataclass
from functools import cache

import plotly.graph_objects as go
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from flexgui.views.layout import caption


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


def plot(figure: go.Figure | None) -> Plot | None:
    """A figure as JSON that is safe inside a script element."""
    if figure is None:
        return None
    text = figure.to_json().replace("<", "\\u003c").replace("\u2028", "\\u2028")
    return Plot(Markup(text), int(figure.layout.height), caption(figure))
