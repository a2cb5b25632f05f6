"""Correlations between the estimates of one fit."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from core.results import Fit
from flexgui.views import colours
from flexgui.views.layout import styled
from flexgui.views.names import plain_symbol

WRITTEN = 9
"""Up to so many parameters the numbers fit into the cells, on a phone too."""


def correlation(fit: Fit) -> go.Figure | None:
    """Heat map of the (p, p) correlations from -1 to 1; None for fewer than two parameters."""
    if len(fit.estimates) < 2 or not np.isfinite(fit.correlation).any():
        return None
    names = [
        plain_symbol(e.symbol, e.name) + (f" ({e.recording})" if e.recording else "")
        for e in fit.estimates
    ]
    figure = go.Figure(
        go.Heatmap(
            z=fit.correlation,
            x=list(range(len(names))),
            y=list(range(len(names))),
            zmin=-1,
            zmax=1,
            colorscale=[list(stop) for stop in colours.DIVERGING],
            texttemplate="%{z:.2f}" if len(names) <= WRITTEN else None,
            hovertemplate="%{z:.4f}<extra></extra>",
            xgap=2,
            ygap=2,
            colorbar={"title": {"text": "correlation [–]", "side": "right"}, "thickness": 12},
        )
    )
    ticks = {"tickvals": list(range(len(names))), "ticktext": names, "automargin": True}
    figure.update_xaxes(title_text="parameter", **ticks)
    figure.update_yaxes(title_text="parameter", autorange="reversed", **ticks)
    text = (
        f"Correlations of {fit.label}. Near ±1 the data hardly distinguish the two: "
        "a change of one nearly compensates the other."
    )
    return styled(figure, 200 + 44 * min(max(len(names), 3), 12), text)
