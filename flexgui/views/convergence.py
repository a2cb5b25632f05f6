"""How the evolution closed in: best cost and spread of the population per generation."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go

from core.results import Fit
from flexgui.views import colours
from flexgui.views.layout import styled

BANDS = 3
"""Up to so many fits show their population's spread; more would hide each other."""
TWO_DECADES = 100.0
"""Over more than that the powers of ten are ticks enough."""


def convergence(fits: Sequence[Fit]) -> go.Figure | None:
    """Cost over generations on a logarithmic axis; None where no fit evolved."""
    evolved = [fit for fit in fits if len(fit.convergence) > 1]
    if not evolved:
        return None
    figure = go.Figure()
    for k, fit in enumerate(evolved):
        _add_fit(figure, fit, colours.series(k), band=len(evolved) <= BANDS)
    figure.update_yaxes(type="log", title_text="cost V [–]", exponentformat="power")
    costs = [c for f in evolved for g in f.convergence for c in (g.best, g.worst) if c > 0]
    if costs and max(costs) > TWO_DECADES * min(costs):
        figure.update_yaxes(dtick=1)
    figure.update_xaxes(title_text="generation [–]")
    text = "Line: best member of each generation."
    if len(evolved) <= BANDS:
        text += " Dotted: mean of the population. Shaded: from its best to its worst member."
    return styled(figure, 380, text, hovermode="x unified")


def _add_fit(figure: go.Figure, fit: Fit, colour: str, band: bool) -> None:
    numbers = [g.number for g in fit.convergence]
    best = [g.best for g in fit.convergence]
    common = {"x": numbers, "legendgroup": fit.label, "hoverinfo": "skip", "showlegend": False}
    if band:
        figure.add_scatter(**common, y=best, mode="lines", line={"width": 0, "color": colour})
        figure.add_scatter(
            **common,
            y=[g.worst for g in fit.convergence],
            mode="lines",
            line={"width": 0, "color": colour},
            fill="tonexty",
            fillcolor=colours.faded(colour, 0.18),
        )
        figure.add_scatter(
            **common,
            y=[g.mean for g in fit.convergence],
            mode="lines",
            line={"width": 1.2, "dash": "dot", "color": colour},
        )
    figure.add_scatter(
        x=numbers,
        y=best,
        mode="lines",
        name=fit.label,
        legendgroup=fit.label,
        line={"width": 2, "color": colour},
        hovertemplate="%{y:.6g}",
        showlegend=True,
    )
