"""What the data cannot distinguish: valleys of the cost, and correlations of the estimates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexgui.core.results import Fit
from flexgui.sentences.identifiability import invariant
from flexgui.sentences.written import format_number, shown_unit
from flexgui.views import colours
from flexgui.views.layout import Figure, axis, dots, figure, heat, line, named_axis
from flexgui.views.names import is_of_a_start, plain_symbol

VISIBLE = 0.01
"""%, a rise of the cost below this is none."""


def valley(fits: Sequence[Fit]) -> Figure | None:
    """The curve of (nearly) equal cost in the plane of two parameters, and the ends of the fits.

    None where no fit found a valley.
    """
    curve = next((f.identifiability.valley for f in fits if f.identifiability.valley), None)
    if curve is None:
        return None
    units = [shown_unit(curve.points[:, k], curve.units[k]) for k in range(2)]
    factors = np.array([unit.factor for unit in units])
    order = np.argsort(curve.points[:, 0])
    x, y = (curve.points[order] * factors).T
    hover = "%{x:.5g}, %{y:.5g}<br>cost / least cost %{customdata:.6g}<extra></extra>"
    name = f"{invariant(curve)} = const"
    traces = [line(x, y, name, colours.MODEL, hover, width=2.5, customdata=curve.cost_ratio[order])]
    plain = "%{x:.5g}, %{y:.5g}<extra></extra>"
    population = _last_population(fits, curve.names)
    if population is not None:
        x, y = (population * factors).T
        colour = colours.faded(colours.START, 0.6)
        traces.append(dots(x, y, "last population", colour, plain, size=6))
    ended = [(f.label, {e.name: e for e in f.estimates}) for f in fits]
    pairs = [(label, [e[n] for n in curve.names]) for label, e in ended if {*curve.names} <= {*e}]
    if pairs:
        x, y = (np.array([[e.value for e in pair] for _, pair in pairs]) * factors).T
        name = "where the fits ended" if len(pairs) > 1 else "where the fit ended"
        style: Figure = {"size": 10, "symbol": "diamond"}
        ends = dots(x, y, name, colours.MODEL, f"%{{text}}<br>{plain}", **style)
        traces.append(ends | {"text": [label for label, _ in pairs]})
    starts = np.array([[e.start for e in pair] for _, pair in pairs]).reshape(-1, 2)
    starts = starts[np.isfinite(starts).all(axis=1)][:1] * factors
    if len(starts):
        x, y = starts.T
        style = {"size": 9, "symbol": "x-thin", "line": {"width": 2, "color": colours.START}}
        traces.append(dots(x, y, "start", colours.START, f"start {plain}", **style))
    rise = 100.0 * (float(np.nanmax(curve.cost_ratio)) - 1.0)
    most = f"rises by {format_number(rise, 2)} % at most"
    change = most if rise >= VISIBLE else "does not change"
    text = (
        f"Along the curve {invariant(curve)} is constant and the cost {change}. The data cannot "
        f"distinguish its points."
    )
    symbols = {e.name: e.symbol for fit in fits for e in fit.estimates}
    x_axis, y_axis = (
        axis(unit.label(plain_symbol(symbols.get(name, ""), name)))
        for unit, name in zip(units, curve.names, strict=True)
    )
    return figure(traces, x_axis, y_axis, text, 420, hovermode="closest")


def _last_population(fits: Sequence[Fit], names: tuple[str, str]) -> np.ndarray | None:
    """(N, 2) last populations of all fits of both parameters."""
    points = []
    for fit in fits:
        estimated = [e.name for e in fit.estimates]
        if fit.convergence and set(names) <= set(estimated):
            members = fit.convergence[-1].population
            if members is not None:
                points.append(members[:, [estimated.index(name) for name in names]])
    return np.concatenate(points) if points else None


WRITTEN = 9
"""Up to so many parameters the numbers fit into the cells, on a phone too."""


def correlation(fit: Fit) -> Figure | None:
    """Heat map of the (p, p) correlations from -1 to 1; None for fewer than two parameters."""
    # The states in which recordings begin are dozens, and say nothing of the arm.
    shown = [k for k, e in enumerate(fit.estimates) if not is_of_a_start(e)]
    if len(shown) < 2 or not np.isfinite(fit.correlation).any():
        return None
    names = [
        plain_symbol(e.symbol, e.name) + (f" ({e.recording})" if e.recording else "")
        for e in (fit.estimates[k] for k in shown)
    ]
    cells = heat(
        fit.correlation[np.ix_(shown, shown)], colours.DIVERGING, "correlation [–]",
        zmin=-1, zmax=1, texttemplate="%{z:.2f}" if len(names) <= WRITTEN else None,
        hovertemplate="%{z:.4f}<extra></extra>", xgap=2, ygap=2,
    )  # fmt: skip
    text = f"Correlations of {fit.label}. Near ±1 the data hardly distinguish the two parameters."
    x = named_axis(names, "parameter", automargin=True)
    height = 200 + 44 * min(max(len(names), 3), 12)
    return figure([cells], x, x | {"autorange": "reversed"}, text, height)
