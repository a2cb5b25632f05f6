"""Tables of parameters: estimates, scatter between runs, comparison with the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from flexgui.core.montecarlo.paper_values import (
    GLOCAL,
    LABELS,
    MEAN,
    SNR_20,
    SNR_NONE,
    WORKING_POINTS,
    Numbers,
    stiffness,
)
from flexgui.core.results import Estimate, Fit, LadderStep, Outcome, Repeated
from flexgui.sentences.written import (
    ShownUnit,
    estimate_text,
    format_number,
    format_value,
    shown_unit,
    with_unit,
)
from flexgui.views.headline import (
    BIASED,
    COMPLETE,
    STILL_MISSING,
    final_derived_names,
    final_estimates,
    final_is_biased,
    first_estimates,
    first_is_biased,
    owner_title,
)
from flexgui.views.names import is_of_a_start, typeset
from flexgui.views.pooled import derived_names, overall_estimates
from flexgui.views.table import Row, Table, numbers, texts

NORMAL_95 = 1.959964
"""Half the width of a 95 % interval in standard deviations of a normal distribution."""

PARAMETER_COLUMNS = (
    *texts("Parameter"), *numbers("Estimate ± std", "95 % interval", "Start", "Bounds"),
    *texts("Identifiable"),
)  # fmt: skip

COLOURED = (
    "The standard deviation (std) allows for coloured residuals. Not identifiable: the data do "
    "not determine it (no std), another parameter imitates it, or its std exceeds its value."
)
FOLLOWS = "(follows): computed from the other estimates."
OF_MEAN = "The mean's std is √(Σ std²)/n for n independent fits."
STARTS = "The initial states were estimated too; see the exported parameters.csv."


def parameters(fits: Sequence[Fit]) -> Table:
    """A row per parameter; with several fits a block each, and the mean at the end."""
    several, derived = len(fits) > 1, derived_names(fits)
    everything = [(fit, e) for fit in fits for e in (*fit.estimates, *fit.derived)]
    shown = [(fit, e) for fit, e in everything if not is_of_a_start(e)]
    first = ("Fit",) if several else ("Recording",) if any(e.recording for _, e in shown) else ()
    rows = []
    for fit, e in shown:
        label = fit.label if several else e.recording or "all"
        cells = _cells(e, e.name in derived)
        rows.append(Row((label, *cells) if first else cells))
    if several:
        label = f"mean of {len(fits)}"
        mean = [e for e in overall_estimates(fits) if e.recording is None]
        rows += [Row((label, *_cells(e, e.name in derived)), strong=True) for e in mean]
    caption = _joined(
        COLOURED,
        FOLLOWS if derived else "",
        OF_MEAN if several else "",
        STARTS if len(shown) < len(everything) else "",
    )
    return Table((*texts(*first), *PARAMETER_COLUMNS), tuple(rows), caption)


def final_parameters(outcome: Outcome) -> Table:
    """Parameters of the model after the diagnosis with their owner; else of the fits."""
    if outcome.diagnosis is None or not outcome.diagnosis.parameters:
        table = parameters(outcome.fits)
        return replace(table, caption=f"{table.caption} {COMPLETE}")
    shown, derived = final_estimates(outcome), final_derived_names(outcome)
    starts = any(is_of_a_start(e) for fit in outcome.fits for e in fit.estimates)
    own = any(e.recording for e in shown)
    rows = []
    for e in shown:
        labels = (owner_title(outcome, e.name), *((e.recording or "all",) if own else ()))
        rows.append(Row((*labels, *_cells(e, e.name in derived))))
    caption = _joined(
        "Of the current model, including the added effects." if outcome.diagnosis.added else "",
        COMPLETE,
        STILL_MISSING if final_is_biased(outcome) else "",
        COLOURED,
        FOLLOWS if derived else "",
        STARTS if starts else "",
    )
    heads = texts("Belongs to", *(("Recording",) if own else ()))
    return Table((*heads, *PARAMETER_COLUMNS), tuple(rows), caption)


class Change(NamedTuple):
    """A parameter of the model as given and of the last one, each by the diagnosis fit."""

    before: Estimate | None
    """None of an effect that was added."""
    after: Estimate | None
    """None of what is no longer in the model."""

    @property
    def of(self) -> Estimate:
        """One that says name, symbol and unit."""
        either = self.after or self.before
        assert either is not None
        return either

    @property
    def in_std(self) -> float:
        """The change in standard deviations of the value as given; NaN where one is not known."""
        before, after = self.before, self.after
        if before is None or after is None or before.undetermined or not before.std > 0.0:
            return float("nan")
        return (after.value - before.value) / before.std


def changes(steps: Sequence[LadderStep], last: Sequence[Estimate] = ()) -> tuple[Change, ...]:
    """Parameters before and after all steps but the first, those of the model as given first;
    `last`: of the last model, where its step is not the whole of it. Empty for a single step."""
    if len(steps) < 2:
        return ()
    before, after = (
        {e.name: e for e in estimates if not e.recording}
        for estimates in (steps[0].parameters, last or steps[-1].parameters)
    )
    return tuple(Change(before.get(name), after.get(name)) for name in {**before, **after})


CHANGED = f"{COMPLETE} Change: in standard deviations (std) of the value as given."


def parameter_changes(found: Sequence[Change], effects: str) -> Table | None:
    """A row per parameter, before and after `effects` were added; None where nothing changed."""
    heads = (*texts("Parameter", "Unit"), *numbers("As given", f"With {effects}", "Change [std]"))
    rows = tuple(_changed_row(change) for change in found)
    return Table(heads, rows, CHANGED) if rows else None


def _changed_row(change: Change) -> Row:
    each = (change.before, change.after)
    unit = shown_unit(np.array([e.value for e in each if e is not None]), change.of.unit)
    moved = format_number(change.in_std, 2, keep_zeros=True)
    shown = f"+{moved}" if change.in_std > 0.0 else moved
    return Row(
        (
            typeset(change.of.symbol, change.of.name), unit.name or "–",
            *(_without_unit(e, unit) for e in each),
            "new" if change.before is None else shown if np.isfinite(change.in_std) else "–",
        )
    )  # fmt: skip


def _without_unit(estimate: Estimate | None, unit: ShownUnit) -> str:
    if estimate is None:
        return "–"
    if estimate.undetermined:
        return "not determined"
    return format_value(estimate.value * unit.factor, estimate.std * unit.factor)


def first_parameters(outcome: Outcome) -> Table | None:
    """Parameters of the first fit, if the diagnosis has a fit of its own; else None."""
    if outcome.diagnosis is None or not (outcome.diagnosis.parameters and first_estimates(outcome)):
        return None
    table = parameters(outcome.fits)
    if outcome.as_given:
        rows = tuple(Row(_cells(e, False)) for e in outcome.as_given)
        table = Table(PARAMETER_COLUMNS, rows, COLOURED)
    prefix = f"{BIASED[0].upper()}{BIASED[1:]}." if first_is_biased(outcome) else ""
    return replace(table, caption=_joined(prefix, table.caption))


def _joined(*sentences: str) -> str:
    return " ".join(sentence for sentence in sentences if sentence)


def _cells(estimate: Estimate, derived: bool) -> tuple[str, ...]:
    unit = shown_unit(estimate.value, estimate.unit)
    start = with_unit(format_number(estimate.start * unit.factor), unit.name)
    ends = [end * unit.factor for end in (estimate.lower, estimate.upper)]
    bounds = with_unit(" … ".join(format_number(end, 3) for end in ends), unit.name)
    return (
        typeset(estimate.symbol, estimate.name) + (" (follows)" if derived else ""),
        estimate_text(estimate),
        interval(estimate, unit),
        start if np.isfinite(estimate.start) else "–",
        bounds if np.isfinite(ends).any() else "none",
        f"{'yes' if estimate.identifiable else 'no'}{', at its bound' * estimate.at_bound}",
    )


def interval(estimate: Estimate, unit: ShownUnit) -> str:
    """'520.79 … 520.87 N m²', or '–' if the data do not determine the parameter."""
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


REPEATED_COLUMNS = (
    *texts("Parameter"), *numbers("Mean of the runs", "95 % interval of the mean"),
    *numbers("Std between runs", "Std within a run"), *texts("Runs that differ"),
)  # fmt: skip
REPEATED_CAPTION = (
    "Runs of the same experiment, each with its own estimates. Expect the next run to scatter by "
    "the std between runs. The std within a run does not include changes of the rig between runs "
    "(temperature, load, gain). Mean and interval leave out runs that differ."
)


def between_runs(repeated: Sequence[Repeated]) -> Table | None:
    """A row per parameter; None where nothing was repeated."""
    rows = tuple(_repeated_row(row) for row in repeated)
    return Table(REPEATED_COLUMNS, rows, REPEATED_CAPTION) if rows else None


IN_REPORT = ("95 % interval", "Start", "Bounds")
"""Columns for which a panel has no room."""


def short_parameters(table: Table, estimates: Sequence[Estimate]) -> Table:
    """For a panel: of several fits only the means; the report holds all."""
    means = tuple(row for row in table.rows if row.strong)
    columns = [k for k, column in enumerate(table.columns) if column.title not in IN_REPORT]
    free = any(not np.isfinite(e.std) for e in estimates if not is_of_a_start(e))
    text = "No standard deviation: the data do not determine the parameter." if free else ""
    return replace(table, rows=means or table.rows).only(columns, text)


def short_between_runs(repeated: Sequence[Repeated]) -> Table | None:
    """The same without the interval, for a panel."""
    whole = between_runs(repeated)
    return None if whole is None else whole.only((0, 1, 3, 4, 5))


def _repeated_row(repeated: Repeated) -> Row:
    unit = shown_unit(repeated.mean, repeated.unit)
    odd = ", ".join(f"{each.run} by {100.0 * each.share:+.2g} %" for each in repeated.disagreeing)
    is_known = np.isfinite(repeated.interval).all()
    ends = " … ".join(format_number(end * unit.factor, 4) for end in repeated.interval)
    mean, between, within = (
        with_unit(format_number(value * unit.factor, digits), unit.name)
        for value, digits in ((repeated.mean, 4), (repeated.between, 2), (repeated.within, 2))
    )
    shares = [
        f" ({format_number(100.0 * deviation / abs(repeated.mean), 2)} %)" if repeated.mean else ""
        for deviation in (repeated.between, repeated.within)
    ]
    return Row(
        (
            typeset("", repeated.name), mean, with_unit(ends, unit.name) if is_known else "–",
            between + shares[0], within + shares[1], odd.replace("-", "−") or "none",
        )
    )  # fmt: skip


PRINTED_COLUMNS = (
    *texts("Fit"), *numbers("paper ε [GPa]", "ours", "paper d [mm]", "ours"),
    *numbers("paper EI [N m²]", "ours"),
)  # fmt: skip


def paper_table(fits: Sequence[Fit], points: Sequence[float], noisy: bool) -> Table:
    """A row per fit of the paper; `points` are the working points (rad) of the local fits."""
    values = [{e.name: e.value for e in (*fit.estimates, *fit.derived)} for fit in fits]
    ours: dict[int, dict[str, float]] = {}
    if len(fits) == 1:
        ours[GLOCAL] = values[0]
    else:
        for found, point in zip(values, points, strict=False):
            ours[int(np.argmin(np.abs(np.array(WORKING_POINTS) - point)))] = found
    local = list(ours.values())
    if len(local) > 1:
        names = set.intersection(*(set(found) for found in local))
        ours[MEAN] = {name: float(np.mean([found[name] for found in local])) for name in names}
    published = SNR_20 if noisy else SNR_NONE
    rows = [_printed_row(LABELS[k], row, ours.get(k, {})) for k, row in enumerate(published)]
    text = (
        "Paper: mean ± std of 20 runs; its EI follows from the means. Ours: this run. The data "
        "determine EI, but not ε and d separately: only EI has to agree."
    )
    return Table(PRINTED_COLUMNS, tuple(rows), text)


def _printed_row(label: str, published: Numbers, ours: dict[str, float]) -> Row:
    eps, eps_std, d, d_std = published
    found = [
        format_number(ours.get(name, float("nan")) * factor, digits, keep_zeros=True)
        for name, factor, digits in (("epsilon", 1e-9, 5), ("d", 1e3, 4), ("EI", 1.0, 5))
    ]
    printed = (f"{eps:.4f} ± {eps_std:.4f}", f"{d:.1f} ± {d_std:.3g}", f"{stiffness(eps, d):.1f}")
    pairs = zip(printed, found, strict=True)
    return Row((label, *(text for pair in pairs for text in pair)), strong=bool(ours))
