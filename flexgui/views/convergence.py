"""Convergence of an identification: costs, population and parameters while it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexgui.core.results import Fit, Generation
from flexgui.sentences.written import format_number, shown_unit, with_unit
from flexgui.views import colours
from flexgui.views.layout import Figure, axis, dots, figure, headline, line
from flexgui.views.names import plain_symbol, typeset
from flexgui.views.table import Row, Table, numbers, texts

BANDS = 3
"""Up to so many fits show the spread of their population; more would hide each other."""

LIVE_POINTS = 300
"""Generations in a plot of some 400 pixels."""

TWO_OCTAVES = 4.0
"""Within less than that a logarithmic axis has hardly a tick."""

TWO_DECADES = 100.0
"""Over more than that the powers of ten are ticks enough."""

History = Mapping[str, Sequence[Generation]]
"""Of each fit, by its label."""


def convergence(fits: Sequence[Fit]) -> Figure | None:
    """Cost over generations on a logarithmic axis; None without generations."""
    history = {fit.label: fit.convergence for fit in fits if len(fit.convergence) > 1}
    text = "Line: best of each generation."
    if len(history) <= BANDS:
        text += " Dotted: population mean. Shaded: best to worst member."
    return _costs(history, text, 380) if history else None


def live_convergence(history: History) -> Figure | None:
    """The same while it runs; None before a second generation: one dot shows no convergence."""
    few = {label: _few(generations) for label, generations in history.items()}
    more = max(map(len, few.values()), default=0) > 1
    return _costs(few, title=headline("Cost")) if more else None


def live_descent(costs: Mapping[str, Sequence[float]]) -> Figure | None:
    """Costs of fits without a population, in the order of their steps; None without two of them.

    A cost that rises is of another start, or of more of the recordings: it begins a line of its
    own at the left. A lone first step that was not the best is left out, as is a fit of one step.
    """
    traces = []
    for k, (label, reported) in enumerate(costs.items()):
        values = np.array(reported[-LIVE_POINTS:])
        descents = np.split(values, np.flatnonzero(np.diff(values) > 0.0) + 1)
        best = min(descents, key=lambda part: part[-1])
        shown = [part for part in descents if len(part) > 1 or part is best]
        if max(map(len, shown)) < 2:
            continue
        steps = _joined([np.arange(1.0, len(part) + 1.0) for part in shown])
        style = {"mode": "lines+markers", "marker": {"size": 5}}
        drawn = line(steps, _joined(shown), label, colours.series(k), "%{y:.4g}", **style)
        traces.append(drawn)
    cost = axis("mean square error [–]", type="log", exponentformat="power")
    title = headline("Cost")
    return figure(traces, axis("step [–]"), cost, title=title) if traces else None


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    """One after the other, with a gap between them."""
    gap = np.array([np.nan])
    return np.concatenate([x for part in parts for x in (part, gap)][:-1])


def _costs(history: History, caption: str = "", height: int = 260, **layout: Figure) -> Figure:
    few = len(history) <= BANDS
    traces = [
        trace
        for k, (label, generations) in enumerate(history.items())
        for trace in _cost_lines(label, generations, colours.series(k), few, len(history) == 1)
    ]
    every = (g for generations in history.values() for g in generations)
    costs = [c for g in every for c in (g.best, g.worst)[: 1 + few] if c > 0.0]
    span = max(costs) / min(costs) if costs else 1.0
    ticks = {"dtick": 1} if span > TWO_DECADES else {"dtick": "D2"}
    scale = {} if span < TWO_OCTAVES else {"type": "log", **ticks}
    return figure(
        traces, axis("generation [–]", rangemode="tozero"),
        axis("cost V [–]", exponentformat="power", **scale), caption, height,
        hovermode="x unified" if few else "closest", **layout,
    )  # fmt: skip


def _cost_lines(
    label: str, generations: Sequence[Generation], colour: str, band: bool, alone: bool
) -> list[Figure]:
    """The best member, and if there is space the mean and the spread of the population."""
    x = np.array([g.number for g in generations], dtype=float)
    best, mean, worst = (
        np.array([getattr(g, name) for g in generations]) for name in ("best", "mean", "worst")
    )
    group: Figure = {} if alone else {"legendgroup": label}
    shown = line(x, best, label, colour, "%{y:.6g}", width=2, **group)
    if not band:
        return [shown]
    quiet: Figure = {"hoverinfo": "skip", "showlegend": False, **group}
    fill: Figure = {"fill": "tonexty", "fillcolor": colours.faded(colour, 0.18)}
    return [
        line(x, best, "", colour, width=0, **quiet),
        line(x, worst, "", colour, width=0, **quiet, **fill),
        line(x, mean, "mean", colour, width=1.2, dash="dot", **quiet | {"showlegend": alone}),
        shown,
    ]


def _few(generations: Sequence[Generation]) -> list[Generation]:
    """The newest histories, few enough for a browser that draws several times a second."""
    every = -(-len(generations) // LIVE_POINTS)
    return list(generations[::-1][:: max(every, 1)][::-1])


@dataclass(frozen=True)
class Searched:
    """A parameter that the evolution searches: a column of the population."""

    name: str
    symbol: str
    unit: str
    lower: float
    upper: float


def live_plane(history: History, searched: Sequence[Searched]) -> Figure | None:
    """Newest population over the first two parameters; with epsilon and d the valley of one EI.

    None where fewer than two parameters are searched.
    """
    if len(searched) < 2 or not history:
        return None
    names = [s.name for s in searched]
    of_paper = {"epsilon", "d"} <= set(names)
    pair = [names.index(n) for n in ("epsilon", "d")] if of_paper else [0, 1]
    chosen = [searched[k] for k in pair]
    units = [shown_unit(s.upper if np.isfinite(s.upper) else 1.0, s.unit) for s in chosen]
    factors = np.array([unit.factor for unit in units])
    traces: list[Figure] = []
    newest = [generations[-1] for generations in history.values() if generations]
    best = np.array([g.best_vector[pair] for g in newest if len(g.best_vector) > max(pair)])
    if len(best) and of_paper:
        traces.append(_valley(chosen[0], best.mean(axis=0), factors))
    for g in newest[-1:]:
        if g.population is not None:
            x, y = (g.population[:, pair] * factors).T
            traces.append(dots(x, y, "population", colours.faded(colours.START, 0.65), size=6))
    if len(best):
        x, y = (best * factors).T
        traces.append(dots(x, y, "best", colours.MODEL, size=10, symbol="diamond"))
    x_axis, y_axis = (
        axis(unit.label(plain_symbol(s.symbol, s.name)), range=_range(s, unit.factor))
        for s, unit in zip(chosen, units, strict=True)
    )
    return figure(traces, x_axis, y_axis, title=headline("Population"), hovermode="closest")


def _valley(epsilon: Searched, best: np.ndarray, factors: np.ndarray) -> Figure:
    """ε d⁴ = const through the best member."""
    eps = np.linspace(epsilon.lower, epsilon.upper, 60)
    d = (best[0] * best[1] ** 4 / eps) ** 0.25
    colour = colours.faded(colours.MODEL, 0.7)
    x, y = eps * factors[0], d * factors[1]
    return line(x, y, "valley ε d⁴ = const", colour, dash="dash", hoverinfo="skip")


def _range(s: Searched, factor: float) -> list[float] | None:
    if not np.isfinite([s.lower, s.upper]).all():
        return None
    margin = 0.04 * (s.upper - s.lower)
    return [float((s.lower - margin) * factor), float((s.upper + margin) * factor)]


SEARCHED_COLUMNS = (
    *texts("Parameter"), *numbers("Best so far", "Spread of the population", "Bounds")
)  # fmt: skip


def live_parameters(history: History, searched: Sequence[Searched]) -> Table | None:
    """Parameters of the newest fit; None before its first generation."""
    if not history:
        return None
    label, generations = list(history.items())[-1]
    newest, rows = generations[-1], []
    spread = np.full(len(searched), np.nan)
    if newest.population is not None:
        spread = np.std(newest.population, axis=0)
    for s, value, deviation in zip(searched, newest.best_vector, spread, strict=False):
        unit = shown_unit(float(value), s.unit)
        ends = " … ".join(format_number(end * unit.factor, 3) for end in (s.lower, s.upper))
        found = (
            format_number(float(value) * unit.factor, 5, keep_zeros=True),
            format_number(float(deviation) * unit.factor, 2),
            ends,
        )
        rows.append(
            Row((typeset(s.symbol, s.name), *(with_unit(text, unit.name) for text in found)))
        )
    return Table(SEARCHED_COLUMNS, tuple(rows), f"{label}, generation {newest.number}.")
