"""How an identification closes in: its costs, its population, and the parameters while it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from flexgui.core.results import Fit, Generation
from flexgui.sentences.written import format_number, shown_unit, with_unit
from flexgui.views import colours
from flexgui.views.layout import Figure, ax, dots, figure, line, styled
from flexgui.views.names import plain_symbol, typeset
from flexgui.views.table import Column, Row, Table


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


BANDS = 3
"""Up to so many fits show the spread of their population; more would hide each other."""

LIVE_POINTS = 300
"""Generations in a plot of some 400 pixels."""

TWO_OCTAVES = 4.0
"""Within less than that a logarithmic axis has hardly a tick."""

TWO_DECADES = 100.0
"""Over more than that the powers of ten are ticks enough."""

History = Mapping[str, Sequence[Generation]]


@dataclass(frozen=True)
class Searched:
    """A parameter that the evolution searches: a column of the population."""

    name: str
    symbol: str
    unit: str
    lower: float
    upper: float


def live_convergence(history: History) -> Figure:
    """Best cost of each fit, and the spread from best to worst, on a logarithmic axis."""
    traces: list[Figure] = []
    several = len(history) > 1
    for k, (label, every) in enumerate(history.items()):
        generations = _few(every)
        colour = colours.series(k) if several else colours.MODEL
        numbers = np.array([g.number for g in generations], dtype=float)
        best = np.array([g.best for g in generations])
        if len(history) <= BANDS:
            traces += _small_band(numbers, best, np.array([g.worst for g in generations]), colour)
        traces.append(line(numbers, best, label if several else "best", colour, width=2))
        if not several:
            mean = np.array([g.mean for g in generations])
            traces.append(line(numbers, mean, "mean", colour, dash="dot", width=1.2))
    few = len(history) <= BANDS
    shown = [
        c
        for generations in history.values()
        for g in generations
        for c in (g.best, g.worst)[: 1 + few]
    ]
    costs = [c for c in shown if c > 0.0]
    wide = bool(costs) and max(costs) > TWO_DECADES * min(costs)
    narrow = bool(costs) and max(costs) < TWO_OCTAVES * min(costs)
    scale = {} if narrow else {"type": "log", "dtick": 1 if wide else "D2"}
    y = ax("cost V [–]", exponentformat="power", **scale)
    return figure(
        traces, ax("generation [–]", rangemode="tozero"), y, "Cost", showlegend=few,
        hovermode="x unified" if few else "closest",
    )  # fmt: skip


def _few(generations: Sequence[Generation]) -> list[Generation]:
    """Not more than a small plot can show, the newest among them: it is drawn several times each
    second, and a browser that draws thousands of points so often no longer hears a click."""
    every = -(-len(generations) // LIVE_POINTS)
    return list(generations[::-1][:: max(every, 1)][::-1])


def _small_band(x: np.ndarray, low: np.ndarray, high: np.ndarray, colour: str) -> list[Figure]:
    quiet = {"hoverinfo": "skip", "showlegend": False, "width": 0}
    fill = {"fill": "tonexty", "fillcolor": colours.faded(colour, 0.18)}
    return [line(x, low, "", colour, **quiet), line(x, high, "", colour, **quiet, **fill)]


def live_plane(history: History, searched: Sequence[Searched]) -> Figure | None:
    """Newest population over the first two parameters; with epsilon and d the valley of one EI.

    None where fewer than two parameters are searched.
    """
    if len(searched) < 2 or not history:
        return None
    names = [s.name for s in searched]
    pair = [names.index(n) for n in ("epsilon", "d")] if {"epsilon", "d"} <= set(names) else [0, 1]
    chosen = [searched[k] for k in pair]
    units = [shown_unit(s.upper if np.isfinite(s.upper) else 1.0, s.unit) for s in chosen]
    factors = np.array([unit.factor for unit in units])
    traces: list[Figure] = []
    newest = [generations[-1] for generations in history.values() if generations]
    best = np.array([g.best_vector[pair] for g in newest if len(g.best_vector) > max(pair)])
    if len(best) and chosen[0].name == "epsilon" and chosen[1].name == "d":
        traces.append(_valley(chosen, best.mean(axis=0), factors))
    members = [g.population[:, pair] for g in newest[-1:] if g.population is not None]
    if members:
        points = members[0] * factors
        colour = colours.faded(colours.MEASURED, 0.65)
        traces.append(dots(points[:, 0], points[:, 1], "population", colour, size=6))
    if len(best):
        shown = best * factors
        traces.append(
            dots(shown[:, 0], shown[:, 1], "best", colours.MODEL, size=10, symbol="diamond")
        )
    axes = [
        ax(unit.label(plain_symbol(s.symbol, s.name)), range=_range(s, unit.factor))
        for s, unit in zip(chosen, units, strict=True)
    ]
    return figure(traces, axes[0], axes[1], "Population", hovermode="closest")


def _valley(chosen: Sequence[Searched], best: np.ndarray, factors: np.ndarray) -> Figure:
    """ε d⁴ = const through the best member."""
    eps = np.linspace(chosen[0].lower, chosen[0].upper, 60)
    d = (best[0] * best[1] ** 4 / eps) ** 0.25
    return line(
        eps * factors[0], d * factors[1], "valley ε d⁴ = const", colours.faded(colours.MODEL, 0.7),
        dash="dash", hoverinfo="skip",
    )  # fmt: skip


def _range(s: Searched, factor: float) -> list[float] | None:
    if not np.isfinite([s.lower, s.upper]).all():
        return None
    margin = 0.04 * (s.upper - s.lower)
    return [float((s.lower - margin) * factor), float((s.upper + margin) * factor)]


SEARCHED_COLUMNS = (
    Column("Parameter"),
    Column("Best so far", numeric=True),
    Column("Spread of the population", numeric=True),
    Column("Bounds", numeric=True),
)


def live_parameters(history: History, searched: Sequence[Searched]) -> Table | None:
    """Of the newest fit; None before its first generation."""
    if not history:
        return None
    label, generations = list(history.items())[-1]
    newest = generations[-1]
    rows = []
    for k, s in enumerate(searched[: len(newest.best_vector)]):
        value = float(newest.best_vector[k])
        unit = shown_unit(value, s.unit)
        spread = float("nan")
        if newest.population is not None:
            spread = float(np.std(newest.population[:, k]))
        ends = " … ".join(format_number(end * unit.factor, 3) for end in (s.lower, s.upper))
        rows.append(
            Row(
                (
                    typeset(s.symbol, s.name),
                    with_unit(format_number(value * unit.factor, 5, keep_zeros=True), unit.name),
                    with_unit(format_number(spread * unit.factor, 2), unit.name),
                    with_unit(ends, unit.name),
                )
            )
        )
    return Table(SEARCHED_COLUMNS, tuple(rows), f"{label}, generation {newest.number}.")
