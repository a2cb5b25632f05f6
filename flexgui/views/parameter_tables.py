"""Tables of parameters: as estimated, from run to run, and beside those that the paper prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from markupsafe import Markup

from flexgui.core.montecarlo.printed import GLOCAL, LABELS, MEAN, SNR_20, SNR_NONE, WORKING_POINTS
from flexgui.core.results import Estimate, Fit, Outcome, Repeated
from flexgui.sentences.written import ShownUnit, estimate_text, format_number, shown_unit, with_unit
from flexgui.views.headline import (
    BIASED,
    COMPLETE,
    SHORT_OF,
    belongs_in_words,
    follows,
    given,
    given_biased,
    standing,
    standing_biased,
)
from flexgui.views.names import equals, is_of_a_start, typeset
from flexgui.views.pooled import overall_estimates
from flexgui.views.table import Column, Row, Table

NORMAL_95 = 1.959964
"""Half the width of a 95 % interval in standard deviations of a normal distribution."""

COLUMNS = (
    Column("Parameter"),
    Column("Estimate ± std", numeric=True),
    Column("95 % interval", numeric=True),
    Column("Start", numeric=True),
    Column("Bounds", numeric=True),
    Column("Identifiable"),
)


def parameters(fits: Sequence[Fit]) -> Table:
    """A row per parameter; of several fits a block each, and the mean at the end."""
    several = len(fits) > 1
    if not several:
        own = any(e.recording for e in _but_starts(overall_estimates(fits)))
        rows = [_row(fit, e, e.recording or "all", own) for fit in fits for e in _all(fit)]
        return Table(_columns("Recording", own), tuple(rows), _caption(fits))
    rows = [_row(fit, e, fit.label, True) for fit in fits for e in _all(fit)]
    mean = [e for e in overall_estimates(fits) if e.recording is None]
    rows += [_row(fits[0], e, f"mean of {len(fits)}", True, strong=True) for e in mean]
    return Table(_columns("Fit", True), tuple(rows), _caption(fits))


def standing_parameters(outcome: Outcome) -> Table:
    """A row per parameter of the model as it now stands, with what it belongs to; without a
    diagnosis the table of the fits."""
    if outcome.diagnosis is None or not outcome.diagnosis.parameters:
        table = parameters(outcome.fits)
        return replace(table, caption=f"{table.caption} {COMPLETE}")
    shown, derived = _but_starts(standing(outcome)), follows(outcome)
    own = any(e.recording for e in shown)
    columns = (Column("Belongs to"), *_columns("Recording", own))
    rows = []
    for e in shown:
        cells = _cells(e, e.name in derived)
        label = ((e.recording or "all"),) if own else ()
        rows.append(Row((belongs_in_words(outcome, e.name), *label, *cells)))
    added = outcome.diagnosis.added
    text = " ".join(
        part
        for part in (
            "Of the current model, including the added effects." if added else "",
            COMPLETE,
            SHORT_OF if standing_biased(outcome) else "",
            _caption_of(bool(derived), 1),
            STARTS if len(shown) < len(standing(outcome)) else "",
        )
        if part
    )
    return Table(columns, tuple(rows), text)


def given_parameters(outcome: Outcome) -> Table | None:
    """Those of the first fit where the diagnosis speaks of another one; else None."""
    if outcome.diagnosis is None or not (outcome.diagnosis.parameters and given(outcome)):
        return None
    table = parameters(outcome.fits)
    if outcome.as_given:
        rows = tuple(Row(_cells(e, False)) for e in outcome.as_given)
        table = Table(COLUMNS, rows, _caption_of(False, 1))
    prefix = f"{BIASED[0].upper()}{BIASED[1:]}. " if given_biased(outcome) else ""
    return replace(table, caption=f"{prefix}{table.caption}")


def _all(fit: Fit) -> tuple[Estimate, ...]:
    return _but_starts((*fit.estimates, *fit.derived))


def _but_starts(estimates: Sequence[Estimate]) -> tuple[Estimate, ...]:
    """Without the states in which recordings begin: dozens of numbers that say nothing of the
    arm. Exported tables hold them."""
    return tuple(e for e in estimates if not is_of_a_start(e))


def _columns(first: str, wanted: bool) -> tuple[Column, ...]:
    return (Column(first), *COLUMNS) if wanted else COLUMNS


def _row(fit: Fit, estimate: Estimate, label: str, labelled: bool, strong: bool = False) -> Row:
    cells = _cells(estimate, any(e.name == estimate.name for e in fit.derived))
    return Row((label, *cells) if labelled else cells, strong=strong)


def _cells(estimate: Estimate, derived: bool) -> tuple[str, ...]:
    unit = shown_unit(estimate.value, estimate.unit)
    return (
        typeset(estimate.symbol, estimate.name) + (" (follows)" if derived else ""),
        estimate_text(estimate),
        interval(estimate, unit),
        with_unit(format_number(estimate.start * unit.factor), unit.name)
        if np.isfinite(estimate.start)
        else "–",
        _bounds(estimate, unit),
        _verdict(estimate),
    )


def equation(estimate: Estimate) -> Markup:
    """'EI₁ = 520.83 ± 0.02 N m²', for HTML."""
    return equals(typeset(estimate.symbol, estimate.name), estimate_text(estimate))


def interval(estimate: Estimate, unit: ShownUnit) -> str:
    """'520.79 … 520.87 N m²', or '–' where the data leave the parameter free."""
    std = estimate.std
    if not np.isfinite(std) or std <= 0.0 or estimate.undetermined:
        return "–"
    decimals = max(0, int(1 - np.floor(np.log10(std * unit.factor))))
    ends = [(estimate.value + s * NORMAL_95 * std) * unit.factor for s in (-1, 1)]
    digits = [int(np.floor(np.log10(max(abs(end), 1e-300)))) + 1 + decimals for end in ends]
    texts = [
        format_number(e, max(d, 2), keep_zeros=True) for e, d in zip(ends, digits, strict=True)
    ]
    return with_unit(" … ".join(texts), unit.name)


def _bounds(estimate: Estimate, unit: ShownUnit) -> str:
    ends = (estimate.lower * unit.factor, estimate.upper * unit.factor)
    if not np.isfinite(ends).any():
        return "none"
    return with_unit(" … ".join(format_number(end, 3) for end in ends), unit.name)


def _verdict(estimate: Estimate) -> str:
    text = "yes" if estimate.identifiable else "no"
    return f"{text}, at its bound" if estimate.at_bound else text


STARTS = (
    "The state in which each recording begins was estimated too; its numbers are in the exported "
    "parameters.csv."
)


def _caption(fits: Sequence[Fit]) -> str:
    text = _caption_of(any(fit.derived for fit in fits), len(fits))
    left_out = any(len(_all(fit)) < len(fit.estimates) + len(fit.derived) for fit in fits)
    return f"{text} {STARTS}" if left_out else text


def _caption_of(derived: bool, count: int) -> str:
    text = (
        "The standard deviation (std) allows for coloured residuals. A parameter is not "
        "identifiable where the data leave it free (then no deviation is stated), where another "
        "parameter imitates it, or where its deviation exceeds its value."
    )
    if derived:
        text += " (follows): computed from the other estimates."
    if count > 1:
        text += " The mean's std is √(Σ std²)/n for n independent fits."
    return text


REPEATED_COLUMNS = (
    Column("Parameter"),
    Column("Mean of the runs", numeric=True),
    Column("95 % interval of the mean", numeric=True),
    Column("Std between runs", numeric=True),
    Column("Std within a run", numeric=True),
    Column("Runs that differ"),
)
REPEATED_CAPTION = (
    "Runs of the same experiment, each with estimates of its own. What a next run will give "
    "scatters by the deviation between runs; the deviation within a run knows nothing of what the "
    "rig changes from run to run (temperature, load, gain). Runs that differ are left out of mean "
    "and interval."
)


def between_runs(found: Sequence[Repeated]) -> Table | None:
    """A row per parameter; None where nothing was repeated."""
    return (
        Table(REPEATED_COLUMNS, tuple(_repeated_row(one) for one in found), REPEATED_CAPTION)
        if found
        else None
    )


IN_REPORT = ("95 % interval", "Start", "Bounds")
"""Columns for which a panel has no room."""


def short_parameters(table: Table, estimates: Sequence[Estimate]) -> Table:
    """For a panel: of several fits the means only, which leaves the plots in sight; the report
    holds all."""
    means = tuple(row for row in table.rows if row.strong)
    kept = [k for k, column in enumerate(table.columns) if column.title not in IN_REPORT]
    free = any(not np.isfinite(e.std) for e in estimates if not is_of_a_start(e))
    text = "No standard deviation: the data do not determine the parameter." if free else ""
    return replace(table, rows=means or table.rows).only(kept, text)


def short_between_runs(found: Sequence[Repeated]) -> Table | None:
    """The same without the interval, for a panel beside the arm."""
    whole = between_runs(found)
    return None if whole is None else whole.only((0, 1, 3, 4, 5))


def _repeated_row(one: Repeated) -> Row:
    unit = shown_unit(one.mean, one.unit)
    odd = ", ".join(f"{each.run} by {100.0 * each.share:+.2g} %" for each in one.disagreeing)
    return Row(
        (
            typeset("", one.name),
            _shown(one.mean, unit, 4),
            _interval(one, unit),
            f"{_shown(one.between, unit, 2)}{_share(one.between, one.mean)}",
            f"{_shown(one.within, unit, 2)}{_share(one.within, one.mean)}",
            odd.replace("-", "−") or "none",
        )
    )


def _shown(value: float, unit: ShownUnit, digits: int) -> str:
    return with_unit(format_number(value * unit.factor, digits), unit.name)


def _interval(one: Repeated, unit: ShownUnit) -> str:
    ends = [format_number(end * unit.factor, 4) for end in one.interval]
    return with_unit(" … ".join(ends), unit.name) if np.isfinite(one.interval).all() else "–"


def _share(deviation: float, mean: float) -> str:
    return f" ({100.0 * deviation / abs(mean):.2g} %)" if mean else ""


PRINTED_COLUMNS = (
    Column("Fit"),
    Column("paper ε [GPa]", numeric=True),
    Column("ours", numeric=True),
    Column("paper d [mm]", numeric=True),
    Column("ours", numeric=True),
    Column("paper EI [N m²]", numeric=True),
    Column("ours", numeric=True),
)


def paper_table(fits: Sequence[Fit], points: Sequence[float], noisy: bool) -> Table:
    """A row per fit of the paper; `points` are the working points (rad) of the local fits."""
    ours: dict[int, dict[str, Estimate]] = {}
    if len(fits) == 1:
        ours[GLOCAL] = _named(fits[0])
    else:
        for fit, point in zip(fits, points, strict=False):
            ours[int(np.argmin(np.abs(np.array(WORKING_POINTS) - point)))] = _named(fit)
    published = SNR_20 if noisy else SNR_NONE
    rows = [_printed_row(k, numbers, _ours(k, ours)) for k, numbers in enumerate(published)]
    text = (
        "Paper: mean ± deviation of 20 runs; its EI follows from the means. Ours: this one run. "
        "Alone ε and d are not determined, so they may differ along the valley; EI must not."
    )
    return Table(PRINTED_COLUMNS, tuple(rows), text)


def _named(fit: Fit) -> dict[str, Estimate]:
    return {e.name: e for e in (*fit.estimates, *fit.derived)}


def _ours(k: int, ours: dict[int, dict[str, Estimate]]) -> dict[str, float]:
    local = [found for place, found in ours.items() if place < MEAN]
    if k == MEAN and len(local) > 1:
        names = set.intersection(*(set(found) for found in local))
        return {n: float(np.mean([found[n].value for found in local])) for n in names}
    return {name: e.value for name, e in ours.get(k, {}).items()}


def _printed_row(
    k: int, published: tuple[float, float, float, float], ours: dict[str, float]
) -> Row:
    eps, eps_std, d, d_std = published
    stiffness = eps * 1e9 * (d * 1e-3) ** 4 / 12.0
    nan = float("nan")
    cells = (
        LABELS[k],
        f"{eps:.4f} ± {eps_std:.4f}",
        format_number(ours.get("epsilon", nan) * 1e-9, 5, keep_zeros=True),
        f"{d:.1f} ± {d_std:.3g}",
        format_number(ours.get("d", nan) * 1e3, 4, keep_zeros=True),
        f"{stiffness:.1f}",
        format_number(ours.get("EI", nan), 5, keep_zeros=True),
    )
    return Row(cells, strong=bool(ours))
