"""Tables I and II in the paper's layout, the same in EI, and what explains the deviations."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

from core.montecarlo.agreement import comparable, implied_bias, least_scatter
from core.montecarlo.estimates import EstimateRow, EstimateTable, Spread
from core.montecarlo.printed import stiffness
from core.montecarlo.valley import ValleyPrior, explained, pooled
from flexgui.views.numbers import format_number
from flexgui.views.study.words import fit_name, percent, shown, signed, snr
from flexgui.views.table import Column, Row, Table

DIGITS = {"epsilon": (4, 4), "d": (1, 3)}
"""Decimals in the shown unit, as the paper prints them: in general, and of deviations below 1."""

STRONG = ("local mean", "glocal")

Filled = tuple[str, Sequence[str]]
"""A column: its title, and what it says of each fit."""


def parameter_table(tables: Sequence[EstimateTable]) -> Table:
    """Rows as in the paper; per ratio and parameter the paper's mean and deviation, then ours."""
    runs = " and ".join(str(n) for n in sorted({t.runs for t in tables}))
    text = (
        f"Mean over {runs} runs, standard deviation in brackets. The local mean's deviation is "
        f"sqrt(Σ std²)/δ, as in the paper."
    )
    return _by_fit(tables, _parameter_columns, text)


def _parameter_columns(table: EstimateTable) -> Iterator[Filled]:
    told = comparable(table)
    for name in table.rows[0].values:
        symbol, unit, factor = shown(name)
        title = f"{symbol} [{unit}] {snr(table.snr_db)}"
        if told is not None:
            at = 0 if name == "epsilon" else 2
            yield f"{title} paper", [_bracketed(n[at], n[at + 1], name) for n in told]
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
        f"True EI = {_each(f'{EI:.2f}' for EI in true)} N m². 'Of the means' is what the mean ε "
        f"and d give, as a reader of a printed table computes it; 'scatter at least' is "
        f"|4 std(d)/d − std(ε)/ε|."
    )
    return _by_fit(tables, lambda table: _stiffness_columns(table, true), text)


def _stiffness_columns(table: EstimateTable, true: Sequence[float]) -> Iterator[Filled]:
    said, told, rows = snr(table.snr_db), comparable(table), table.rows
    if told is not None:
        implied = [stiffness(n[0], n[2]) for n in told]
        yield f"{said}: paper's means imply [N m²]", [f"{EI:.1f}" for EI in implied]
        yield "bias", [signed(implied_bias(n, true[0])) for n in told]
        yield "scatter at least", [percent(least_scatter(n), 2) for n in told]
    yield f"{said}: EI here [N m²]", [_each(f"{EI.mean:.3f}" for EI in row.EI) for row in rows]
    yield "bias", [_each(_biases(row.EI, true)) for row in rows]
    yield "deviation", [_each(map(_relative, row.EI)) for row in rows]
    means = [format_number(row.EI_of_means, 5, keep_zeros=True) for row in rows]
    yield "of the means [N m²]", means


def _by_fit(
    tables: Sequence[EstimateTable], columns: Callable[[EstimateTable], Iterable[Filled]], text: str
) -> Table:
    """A row per fit; beside each other the columns of each table."""
    filled = [column for table in tables for column in columns(table)]
    heads = (Column("Fit"), *(Column(title, numeric=True) for title, _ in filled))
    cells = zip(*(each for _, each in filled), strict=True)
    rows = (
        Row((fit_name(fit.label, fit.theta2), *here), strong=fit.label in STRONG)
        for fit, here in zip(tables[0].rows, cells, strict=True)
    )
    return Table(heads, tuple(rows), text)


def _biases(found: Iterable[Spread], true: Sequence[float]) -> Iterator[str]:
    return (signed(e.mean / EI - 1.0) for e, EI in zip(found, true, strict=True))


def _each(texts: Iterable[str]) -> str:
    """One text per segment that has a stiffness of its own."""
    return " / ".join(texts)


def _relative(EI: Spread) -> str:
    return percent(EI.std / EI.mean, 2)


def explained_table(table: EstimateTable, prior: ValleyPrior) -> Table:
    """Deviations along the valley: found against expected of prior and search alone."""
    columns = (
        Column("Fit"), Column("quantity"), Column("found", numeric=True),
        Column("prior and search alone", numeric=True), Column("ratio", numeric=True),
        Column("uniform prior cut along the valley", numeric=True),
    )  # fmt: skip
    rows = []
    for e in (*explained(table, prior), *pooled(table, prior)):
        symbol, unit, factor = shown(e.name)
        rows.append(
            Row(
                (
                    e.label, f"std of {symbol} [{unit}]", format_number(e.found * factor, 3),
                    format_number(e.expected * factor, 3), f"{e.ratio:.2f}",
                    format_number(prior.flat[e.name].std * factor, 3),
                ),
                strong=e.label == "all fits",
            )
        )  # fmt: skip
    return Table(columns, tuple(rows), f"At {snr(table.snr_db)}, {table.runs} runs per fit.")


def deviation_table(tables: Sequence[EstimateTable]) -> Table:
    """The deviation of the mean of the local estimates by both formulas, and as found."""
    columns = (
        Column("SNR"), Column("quantity"), Column("sqrt(Σ std²)/δ", numeric=True),
        Column("sqrt(Σ std²/δ), the caption's", numeric=True),
        Column("found over the runs' means", numeric=True), Column("printed", numeric=True),
    )  # fmt: skip
    rows = []
    for table in tables:
        told = comparable(table)
        for d in table.deviations:
            symbol, unit, factor = shown(d.name) if d.name != "EI" else ("EI", "N m²", 1.0)
            printed = "–"
            if told is not None and d.name != "EI":
                printed = format_number(told[7][1 if d.name == "epsilon" else 3], 3)
            cells = [format_number(v * factor, 3) for v in (d.of_mean, d.caption, d.found)]
            rows.append(Row((snr(table.snr_db), f"{symbol} [{unit}]", *cells, printed)))
    return Table(columns, tuple(rows), "Of this study's local estimates; δ is their number.")
