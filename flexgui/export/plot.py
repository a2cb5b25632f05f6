"""Figures as the report's template needs them."""

from __future__ import annotations

from dataclasses import dataclass

import plotly.graph_objects as go
from markupsafe import Markup

from flexgui.views.layout import caption


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
