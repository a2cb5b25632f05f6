"""The error against a joint's speed, place, acceleration or bending, by direction of motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from core.results import ErrorOver
from core.written import ShownUnit, shown_unit
from flexgui.views import colours
from flexgui.views.layout import styled, title
from flexgui.views.names import channel_symbol

HEIGHT_PER_ROW, HEIGHT_OF_FRAME = 230, 100

DIRECTIONS = (("forwards", colours.RESIDUAL), ("backwards", colours.BACKWARDS))


def residual_over(found: Sequence[ErrorOver]) -> go.Figure | None:
    """A row each: the mean error of each direction with the spread around it; None without any."""
    if not found:
        return None
    count = len(found)
    figure = make_subplots(rows=count, cols=1, vertical_spacing=min(0.12, 0.5 / count))
    for row, one in enumerate(found, start=1):
        unit, across = shown_unit(one.rms, one.unit), shown_unit(one.edges, one.quantity_unit)
        for k in range(len(DIRECTIONS)):
            for trace in _direction(one, k, unit, across, row == 1):
                figure.add_trace(trace, row=row, col=1)
        title(figure, row, unit.label(f"Δ{channel_symbol(one.channel, one.unit)}"))
        title(figure, row, across.label(quantity_title(one)), axis="x")
    text = (
        "Mean error (measured minus model) in bins of the motion, forwards and backwards apart; "
        "the band is one standard deviation. A step between the directions points to dry friction, "
        "a slope over the speed to viscous friction, one over the acceleration to a wrong inertia, "
        "one over the deflection to a wrong stiffness."
    )
    return styled(figure, HEIGHT_OF_FRAME + HEIGHT_PER_ROW * count, text, hovermode="closest")


def quantity_title(one: ErrorOver) -> str:
    """'velocity of joint 1'"""
    part = "segment" if one.quantity == "deflection" else "joint"
    return f"{one.quantity} of {part} {one.joint}"


def _direction(
    one: ErrorOver, k: int, unit: ShownUnit, across: ShownUnit, legend: bool
) -> list[go.Scatter]:
    """Mean line and band of one direction of motion."""
    name, colour = DIRECTIONS[k]
    known = np.isfinite(one.mean[k])
    if not known.any():
        return []
    x = (0.5 * (one.edges[:-1] + one.edges[1:]) * across.factor)[known]
    mean = (one.mean[k] * unit.factor)[known]
    spread = np.sqrt(np.maximum(one.rms[k] ** 2 - one.mean[k] ** 2, 0.0))[known] * unit.factor
    band = go.Scatter(
        x=np.concatenate([x, x[::-1]]), y=np.concatenate([mean + spread, (mean - spread)[::-1]]),
        fill="toself", fillcolor=colours.faded(colour, 0.16), line={"width": 0},
        hoverinfo="skip", showlegend=False, legendgroup=name, mode="lines",
    )  # fmt: skip
    line = go.Scatter(
        x=x, y=mean, mode="lines+markers", name=name, legendgroup=name, showlegend=legend,
        line={"color": colour, "width": 1.8}, marker={"size": 5},
        hovertemplate=f"{name}: %{{y:.4g}} {unit.name} at %{{x:.4g}} {across.name}<extra></extra>",
    )  # fmt: skip
    return [band, line]
