"""Tables I and II of the paper beside those of a study, what explains their deviations, and where
the pairs (ε, d) lie: on the valley, inside the box of the prior.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from flexgui.core.montecarlo.estimates import (
    EstimateRow,
    EstimateTable,
    ValleyPrior,
    comparable,
    explained,
    implied_bias,
    least_scatter,
    pooled,
)
from flexgui.core.montecarlo.paper_values import MEAN, Numbers, stiffness
from flexgui.sentences.written import angle, format_number
from flexgui.views import colours
from flexgui.views.layout import Figure, axis, dots, figure, line
from flexgui.views.table import Row, Table, numbers, texts

DIGITS = {"epsilon": (4, 4), "d": (1, 3)}
"""Decimals in the shown unit, as the paper prints them: in general, and of deviations below 1."""

STRONG = ("local mean", "glocal")

Filled = tuple[str, Sequence[str]]
"""A column: its title, and what it says of each fit."""


def parameter_table(tables: Sequence[EstimateTable]) -> Table:
    """Rows as in the paper; per ratio and parameter the paper's mean and deviation, then ours."""
    runs = " and ".join(str(n) for n in sorted({t.runs for t in tables}))
    text = (
        f"Mean over {runs} runs, standard deviation in brackets. Standard deviation of the local "
        f"mean: sqrt(Σ std²)/δ, as in the paper."
    )
    return _by_fit(tables, _parameter_columns, text)


def _parameter_columns(table: EstimateTable) -> Iterator[Filled]:
    published = comparable(table)
    for name in table.rows[0].values:
        symbol, unit, factor = shown(name)
        title = f"{symbol} [{unit}] {snr(table.snr_db)}"
        if published is not None:
            at = 0 if name == "epsilon" else 2
            yield f"{title} paper", [_bracketed(n[at], n[at + 1], name) for n in published]
        means = [row.values[name].mean * factor for row in table.rows]
        stds = [_printed_deviation(table, row, name) * factor for row in table.rows]
        pairs = zip(means, stds, strict=True)
        yield f"{title} here", [_bracketed(mean, std, name) for mean, std in pairs]


def _printed_deviation(table: EstimateTable, row: EstimateRow, name: str) -> float:
    """The paper's formula for the mean of the locals, over the runs for all others."""
    if row.label != "local mean":
        return row.values[name].std
    return next(d.of_mean for d in table.deviations if d.name == name)


def _bracketed(mean: float, std: float, name: str) -> str:
    digits = DIGITS.get(name)
    if digits is None:
        return f"{format_number(mean, 5)} ({format_number(std, 2)})"
    usual, small = digits
    if not math.isfinite(std):
        return f"{mean:.{usual}f}"
    return f"{mean:.{usual}f} ({std:.{small if std < 1.0 else usual}f})"


def stiffness_table(tables: Sequence[EstimateTable], true: Sequence[float]) -> Table:
    """The same rows in EI, with the bias and the scatter that the paper's numbers imply."""
    text = (
        f"True EI = {_each(f'{EI:.2f}' for EI in true)} N m². 'Of the means': computed from the "
        f"mean ε and d. 'Scatter at least': |4 std(d)/d − std(ε)/ε|."
    )
    return _by_fit(tables, lambda table: _stiffness_columns(table, true), text)


def _stiffness_columns(table: EstimateTable, true: Sequence[float]) -> Iterator[Filled]:
    noise, published, rows = snr(table.snr_db), comparable(table), table.rows
    if published is not None:
        implied = [stiffness(n[0], n[2]) for n in published]
        yield f"{noise}: paper's means imply [N m²]", [f"{EI:.1f}" for EI in implied]
        yield "bias", [signed(implied_bias(n, true[0])) for n in published]
        yield "scatter at least", [percent(least_scatter(n), 2) for n in published]
    yield f"{noise}: EI here [N m²]", [_each(f"{EI.mean:.3f}" for EI in row.EI) for row in rows]
    pairs = [list(zip(row.EI, true, strict=True)) for row in rows]
    yield "bias", [_each(signed(e.mean / EI - 1.0) for e, EI in each) for each in pairs]
    yield "deviation", [_each(percent(e.std / e.mean, 2) for e in row.EI) for row in rows]
    means = [format_number(row.EI_of_means, 5, keep_zeros=True) for row in rows]
    yield "of the means [N m²]", means


def _by_fit(
    tables: Sequence[EstimateTable], columns: Callable[[EstimateTable], Iterable[Filled]], text: str
) -> Table:
    """A row per fit; beside each other the columns of each table."""
    titles, found = zip(*(c for table in tables for c in columns(table)), strict=True)
    rows = []
    for fit, *here in zip(tables[0].rows, *found, strict=True):
        name = fit.label if fit.theta2 is None else f"local {angle(fit.theta2)}"
        rows.append(Row((name, *here), strong=fit.label in STRONG))
    return Table((*texts("Fit"), *numbers(*titles)), tuple(rows), text)


def _each(texts: Iterable[str]) -> str:
    """One text per segment that has a stiffness of its own."""
    return " / ".join(texts)


def explained_table(table: EstimateTable, prior: ValleyPrior) -> Table:
    """Deviations along the valley: found against expected of prior and search alone."""
    columns = (
        *texts("Fit", "quantity"), *numbers("found", "prior and search alone", "ratio"),
        *numbers("uniform prior cut along the valley"),
    )  # fmt: skip
    rows = []
    for e in (*explained(table, prior), *pooled(table, prior)):
        symbol, unit, factor = shown(e.name)
        sizes = (e.found, e.expected, prior.flat[e.name].std)
        found, expected, flat = (format_number(size * factor, 3) for size in sizes)
        cells = (e.label, f"std of {symbol} [{unit}]", found, expected, f"{e.ratio:.2f}", flat)
        rows.append(Row(cells, strong=e.label == "all fits"))
    return Table(columns, tuple(rows), f"At {snr(table.snr_db)}, {table.runs} runs per fit.")


def deviation_table(tables: Sequence[EstimateTable]) -> Table:
    """The deviation of the mean of the local estimates by both formulas, and as found."""
    columns = (
        *texts("SNR", "quantity"), *numbers("sqrt(Σ std²)/δ", "sqrt(Σ std²/δ), the caption's"),
        *numbers("found over the runs' means", "printed"),
    )  # fmt: skip
    rows = []
    for table in tables:
        published = comparable(table)
        for d in table.deviations:
            symbol, unit, factor = shown(d.name)
            place = PRINTED_DEVIATION.get(d.name)
            printed = published and place and format_number(published[MEAN][place], 3)
            cells = [format_number(v * factor, 3) for v in (d.of_mean, d.caption, d.found)]
            name = f"{symbol} [{unit}]"
            rows.append(Row((snr(table.snr_db), name, *cells, printed or "–")))
    return Table(columns, tuple(rows), "Of this study's local estimates; δ is their number.")


PRINTED_DEVIATION = {"epsilon": 1, "d": 3}
"""Place of its deviation in the paper's rows."""


GPA, MM = 1e-9, 1e3
MARKS = {None: "circle", 20.0: "diamond"}


def study_valley(
    tables: Sequence[EstimateTable], prior: ValleyPrior | None, true_EI: float
) -> Figure | None:
    """Pairs (ε, d) of all runs, the paper's means, the valley of `true_EI` in N m² and the prior;
    None for others."""
    if not tables or {"epsilon", "d"} != set(tables[0].rows[0].values):
        return None
    epsilons = [p["epsilon"] for t in tables for row in t.rows for p in row.pairs]
    low, high = (min(epsilons), max(epsilons)) if prior is None else prior.bounds["epsilon"]
    epsilon = np.linspace(low, high, 201)
    d = (12.0 * true_EI / epsilon) ** 0.25
    style: Figure = {"width": 2, "hoverinfo": "skip"}
    curve = line(epsilon * GPA, d * MM, "ε d⁴ = const", colours.MODEL, **style)
    published = [(t, means) for t in tables if (means := comparable(t)) is not None]
    traces = [curve, *map(_ours, tables), *(_papers(*pair) for pair in published)]
    text = ["Dots: every fit of every run.", "Curve: all pairs with the true EI."]
    if published:
        text.insert(1, "Large marks: the paper's means.")
    if prior is not None:
        (x0, x1), (y0, y1) = prior.bounds["epsilon"], prior.bounds["d"]
        x, y = np.array([x0, x1, x1, x0, x0]) * GPA, np.array([y0, y0, y1, y1, y0]) * MM
        style = {"width": 1.2, "dash": "dot", "hoverinfo": "skip"}
        traces.insert(0, line(x, y, "prior", colours.BOUND, **style))
        text.append("Box: the prior, in which the first population is drawn.")
    axes = (axis("ε [GPa]"), axis("d [mm]"))
    return figure(traces, *axes, " ".join(text), 480, hovermode="closest")


def _ours(table: EstimateTable) -> Figure:
    single = [
        (p["epsilon"] * GPA, p["d"] * MM, f"{row.label}, run {k}")
        for row in table.rows
        if row.label != "local mean"
        for k, p in enumerate(row.pairs, start=1)
    ]
    x, y, labels = (list(each) for each in zip(*single, strict=True))
    colour = colours.faded(colours.series(0 if table.snr_db is None else 2), 0.55)
    hover = "%{text}<br>%{x:.4f} GPa, %{y:.2f} mm<extra></extra>"
    return dots(x, y, f"here, {snr(table.snr_db)}", colour, hover, size=6) | {"text": labels}


def _papers(table: EstimateTable, published: Sequence[Numbers]) -> Figure:
    x, y = [n[0] for n in published], [n[2] for n in published]
    style = {
        "size": 11, "symbol": MARKS.get(table.snr_db, "square"),
        "line": {"width": 1, "color": colours.HOVER_BACKGROUND},
    }  # fmt: skip
    name, hover = f"paper, {snr(table.snr_db)}", "paper, %{text}<br>%{x:.4f} GPa, %{y:.1f} mm"
    marks = dots(x, y, name, colours.REFERENCE, f"{hover}<extra></extra>", **style)
    return marks | {"text": [row.label for row in table.rows]}


SYMBOLS = {"epsilon": ("ε", "GPa", 1e-9), "d": ("d", "mm", 1e3), "EI": ("EI", "N m²", 1.0)}
"""name -> symbol, shown unit, factor."""

RATES = {
    "tip": "J at the tip's own angles",
    "encoders": "J at the encoders' angles",
    "working point": "J at the working point",
}
EXCITATIONS = {"prbs": "plain PRBS", "prbs_balanced": "balanced PRBS"}


def shown(name: str) -> tuple[str, str, float]:
    """(symbol, unit, factor) of a parameter."""
    return SYMBOLS.get(name, (name, "SI", 1.0))


def percent(share: float, digits: int = 3) -> str:
    """'0.123 %' of the share 0.00123."""
    return f"{format_number(100.0 * share, digits)} %" if math.isfinite(share) else "–"


def signed(share: float) -> str:
    """'+0.12 %' of the share 0.0012."""
    return f"{plus(100.0 * share, 2)} %" if math.isfinite(share) else "–"


def plus(value: float, digits: int) -> str:
    """'+0.03' of a value of any unit, with a true minus, and no sign before a zero."""
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0.0 else text.replace("-", "−")


def snr(snr_db: float | None) -> str:
    """'SNR ∞' or '20 dB' of `snr_db` in dB."""
    return "SNR ∞" if snr_db is None else f"{snr_db:g} dB"
