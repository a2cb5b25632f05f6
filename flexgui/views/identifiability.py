"""What the data cannot tell apart: valleys of the cost, and correlations of the estimates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from flexgui.core.results import Estimate, Fit, Valley
from flexgui.sentences.identifiability import invariant
from flexgui.sentences.written import ShownUnit, shown_unit
from flexgui.views import colours
from flexgui.views.layout import styled
from flexgui.views.names import is_of_a_start, plain_symbol

VISIBLE = 0.01
"""%, a rise of the cost below this is none."""


def valley(fits: Sequence[Fit]) -> go.Figure | None:
    """The curve of (nearly) equal cost in the plane of two parameters, and where fits ended.

    None where no fit found a valley.
    """
    found = next((f.identifiability.valley for f in fits if f.identifiability.valley), None)
    if found is None:
        return None
    units = tuple(shown_unit(found.points[:, k], found.units[k]) for k in range(2))
    figure = go.Figure()
    _add_curve(figure, found, units)
    _add_population(figure, fits, found, units)
    _add_ends(figure, fits, found, units)
    symbols = [_symbol(fits, name) for name in found.names]
    figure.update_xaxes(title_text=units[0].label(symbols[0]))
    figure.update_yaxes(title_text=units[1].label(symbols[1]))
    return styled(figure, 420, _caption(found), hovermode="closest")


def _caption(found: Valley) -> str:
    rise = 100.0 * (float(np.nanmax(found.cost_ratio)) - 1.0)
    change = f"rises by {rise:.2g} % at most" if rise >= VISIBLE else "does not change"
    return (
        f"Along the curve {invariant(found)} is constant and the cost {change}: "
        "the data cannot distinguish its points."
    )


def _add_curve(figure: go.Figure, found: Valley, units: Sequence[ShownUnit]) -> None:
    order = np.argsort(found.points[:, 0])
    points = found.points[order]
    figure.add_scatter(
        x=points[:, 0] * units[0].factor,
        y=points[:, 1] * units[1].factor,
        mode="lines",
        name=f"{invariant(found)} = const",
        line={"color": colours.MODEL, "width": 2.5},
        customdata=found.cost_ratio[order],
        hovertemplate="%{x:.5g}, %{y:.5g}<br>cost / least cost %{customdata:.6g}<extra></extra>",
    )


def _add_ends(
    figure: go.Figure, fits: Sequence[Fit], found: Valley, units: Sequence[ShownUnit]
) -> None:
    pairs = [(f.label, _pair(f.estimates, found.names)) for f in fits]
    known = [(label, pair) for label, pair in pairs if pair is not None]
    if not known:
        return
    figure.add_scatter(
        x=[a.value * units[0].factor for _, (a, _b) in known],
        y=[b.value * units[1].factor for _, (_a, b) in known],
        mode="markers",
        name="where the fits ended" if len(known) > 1 else "where the fit ended",
        marker={"color": colours.MEASURED, "size": 10, "symbol": "diamond"},
        text=[label for label, _ in known],
        hovertemplate="%{text}<br>%{x:.5g}, %{y:.5g}<extra></extra>",
    )
    starts = [(a, b) for _, (a, b) in known if np.isfinite(a.start) and np.isfinite(b.start)]
    if starts:
        a, b = starts[0]
        figure.add_scatter(
            x=[a.start * units[0].factor],
            y=[b.start * units[1].factor],
            mode="markers",
            name="start",
            marker={
                "color": colours.START,
                "size": 9,
                "symbol": "x-thin",
                "line": {"width": 2, "color": colours.START},
            },
            hovertemplate="start %{x:.5g}, %{y:.5g}<extra></extra>",
        )


def _add_population(
    figure: go.Figure, fits: Sequence[Fit], found: Valley, units: Sequence[ShownUnit]
) -> None:
    last = [
        members[:, columns]
        for fit in fits
        if (columns := _columns(fit, found.names)) is not None
        and fit.convergence
        and (members := fit.convergence[-1].population) is not None
    ]
    if not last:
        return
    points = np.concatenate(last)
    figure.add_scatter(
        x=points[:, 0] * units[0].factor,
        y=points[:, 1] * units[1].factor,
        mode="markers",
        name="last population",
        marker={"color": colours.faded(colours.MEASURED, 0.6), "size": 6},
        hovertemplate="%{x:.5g}, %{y:.5g}<extra></extra>",
    )


def _columns(fit: Fit, names: tuple[str, str]) -> list[int] | None:
    known = [e.name for e in fit.estimates]
    return [known.index(n) for n in names] if all(n in known for n in names) else None


def _pair(
    estimates: Sequence[Estimate], names: tuple[str, str]
) -> tuple[Estimate, Estimate] | None:
    found = {e.name: e for e in estimates}
    if any(name not in found for name in names):
        return None
    return found[names[0]], found[names[1]]


def _symbol(fits: Sequence[Fit], name: str) -> str:
    known = (e for fit in fits for e in fit.estimates if e.name == name)
    return plain_symbol(next((e.symbol for e in known), ""), name)


WRITTEN = 9
"""Up to so many parameters the numbers fit into the cells, on a phone too."""


def correlation(fit: Fit) -> go.Figure | None:
    """Heat map of the (p, p) correlations from -1 to 1; None for fewer than two parameters."""
    # The states in which recordings begin are dozens, and say nothing of the arm.
    shown = [k for k, e in enumerate(fit.estimates) if not is_of_a_start(e)]
    if len(shown) < 2 or not np.isfinite(fit.correlation).any():
        return None
    names = [
        plain_symbol(e.symbol, e.name) + (f" ({e.recording})" if e.recording else "")
        for e in (fit.estimates[k] for k in shown)
    ]
    figure = go.Figure(
        go.Heatmap(
            z=fit.correlation[np.ix_(shown, shown)],
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
