"""All that the finished cases of a study say; a part that is not finished yet is missing.

What follows from the figures stands in words; every sentence is made of numbers that were found.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.montecarlo import printed
from core.montecarlo.comparison import (
    LEVELS,
    BaselineRow,
    BiasSource,
    Validation,
    baseline_rows,
    bias_sources,
    validation,
)
from core.montecarlo.estimates import (
    EstimateTable,
    agreements,
    comparable,
    estimate_tables,
    least_scatter,
)
from core.montecarlo.planning import Planning, planning
from core.montecarlo.rig import Rig
from core.montecarlo.settings import StudySettings
from core.montecarlo.study import study_cases
from core.montecarlo.valley import WITHIN, ValleyPrior, explained, pooled, valley_prior
from core.montecarlo.verdicts import about_baselines, about_bias, about_planning, snr_words
from core.resumable.journal import Record
from core.sentences import listed


@dataclass(frozen=True)
class Summary:
    """Tables and figures in numbers; views turn them into something to see."""

    title: str
    settings: StudySettings
    tables: tuple[EstimateTable, ...]
    prior: ValleyPrior | None
    validation: Validation | None
    baselines: tuple[BaselineRow, ...]
    bias: tuple[BiasSource, ...]
    planning: Planning | None
    findings: tuple[tuple[str, str], ...]
    """(heading, paragraph)"""
    stiffness: tuple[float, ...]
    """True EI in N m², as many as the tables have."""

    @property
    def true_EI(self) -> float:
        """N m², of the first segment."""
        return self.stiffness[0]


def summarise(settings: StudySettings, records: Mapping[str, Record]) -> Summary:
    """From records in any order; the same records give the same summary."""
    records = {c.key: records[c.key] for c in study_cases(settings) if c.key in records}
    stiffness = tuple(Rig(settings).stiffness({}))
    EI = stiffness[0]
    tables = estimate_tables(settings, records)
    prior = valley_prior(records, EI)
    checked = validation(records)
    rows = baseline_rows(records)
    sources = bias_sources(records)
    plan = planning(settings, records, tables)
    return Summary(
        settings.scenario.title, settings, tables, prior, checked, rows, sources, plan,
        findings(tables, prior, checked, rows, sources, plan, EI), stiffness,
    )  # fmt: skip


Finding = tuple[str, str]
"""Heading and paragraph."""


def findings(
    tables: Sequence[EstimateTable],
    prior: ValleyPrior | None,
    checked: Validation | None,
    rows: Sequence[BaselineRow],
    sources: Sequence[BiasSource],
    plan: Planning | None,
    EI: float,
) -> tuple[Finding, ...]:
    """As many as the finished parts allow, in the order of a report."""

    def all_of_them() -> Iterator[Finding]:
        clean = next((t for t in tables if t.snr_db is None and t.runs > 1), None)
        if clean is not None:
            yield from _about_valley(clean)
        if clean is not None and prior is not None:
            yield from _about_prior(clean, prior)
        yield from _about_means(tables)
        yield from about_bias(tables, sources, EI)
        yield from _about_scatter(tables)
        yield from _about_deviation_of_mean(tables)
        if checked is not None:
            yield _about_sweeps(checked)
        yield from about_baselines(rows)
        yield from about_planning(plan)

    return tuple(all_of_them())


def ratio_of_deviations(table: EstimateTable) -> float:
    """Smallest over the fits: relative deviation of ε over that of EI."""
    ratios = []
    for row in (*table.locals, table.row("glocal")):
        epsilon, EI = row.values["epsilon"], row.EI[0]
        ratios.append((epsilon.std / epsilon.mean) / max(EI.std / EI.mean, 1e-300))
    return min(ratios)


def _about_valley(table: EstimateTable) -> Iterator[Finding]:
    if {"epsilon", "d"} != set(table.rows[0].values):
        return
    glocal = table.row("glocal")
    epsilon, EI = glocal.values["epsilon"], glocal.EI[0]
    yield (
        "What the data fix",
        f"The model contains ε and d only as EI = ε d⁴ / 12. Without noise the {table.runs} runs "
        f"end anywhere along the valley ε d⁴ = const, so that ε scatters by "
        f"{100.0 * epsilon.std / epsilon.mean:.1f} % (glocal), while EI scatters by "
        f"{100.0 * EI.std / EI.mean:.1g} %: in every fit at least "
        f"{ratio_of_deviations(table):.0f} times less. A table of ε and d therefore shows the "
        f"search and its first population; a table of EI shows the data.",
    )


def _about_prior(table: EstimateTable, prior: ValleyPrior) -> Iterator[Finding]:
    single = [e for e in explained(table, prior) if e.label != "local mean"]
    good = sum(e.good for e in single)
    pool = {e.name: e for e in pooled(table, prior)}
    flat, searched = prior.flat["epsilon"], prior.searched["epsilon"]
    text = (
        f"The uniform prior, cut along the valley, has a deviation of "
        f"{flat.std * 1e-9:.4f} GPa in ε and {prior.flat['d'].std * 1e3:.2f} mm in d. The search "
        f"draws the population together while it moves along the bent valley; the same search on "
        f"the bare product ε d⁴, without any arm or data, ends with {searched.std * 1e-9:.4f} GPa "
        f"and {prior.searched['d'].std * 1e3:.2f} mm ({prior.draws} draws). Found at SNR ∞ over "
        f"all fits: {pool['epsilon'].found * 1e-9:.4f} GPa ({pool['epsilon'].ratio:.2f} of that, "
        f"{pool['epsilon'].found / flat.std:.2f} of the prior without the search) "
        f"and {pool['d'].found * 1e3:.2f} mm ({pool['d'].ratio:.2f}); fit by fit {good} of "
        f"{len(single)} deviations lie within {100.0 * WITHIN:.0f} %."
    )
    published = comparable(table)
    if published is not None:
        paper = float(
            np.sqrt(np.mean([published[k][1] ** 2 for k in (*printed.LOCALS, printed.GLOCAL)]))
        )
        ratio = paper / (flat.std * 1e-9)
        text += (
            f" The paper's own deviations at SNR ∞ ({paper:.4f} GPa in root mean square) are "
            f"{ratio:.2f} times that of the prior cut along the valley."
        )
        if abs(ratio - 1.0) <= WITHIN:
            text += " They say how wide the first population was, not how well ε is known."
    yield "Why ε and d scatter as they do", text


def _about_means(tables: Sequence[EstimateTable]) -> Iterator[Finding]:
    found = agreements(tables)
    if not found:
        return
    missed = [a for a in found if not a.within]
    good = len(found) - len(missed)
    text = f"{good} of {len(found)} means lie within one of the paper's deviations."
    if missed:
        names = {"epsilon": "ε", "d": "d"}
        each = [
            f"{names[a.name]} {a.label} at {snr_words(a.snr_db)} ({a.ours:.4g}, paper "
            f"{a.paper:.4g} ± {a.deviation:.3g})"
            for a in missed
        ]
        text += (
            f" Outside: {listed(each)}. Where both means of a fit cannot lie on the valley of the "
            f"true EI, no unbiased estimate can meet them both."
        )
    yield "Means beside the paper's", text


def _about_scatter(tables: Sequence[EstimateTable]) -> Iterator[Finding]:
    for table in tables:
        published = comparable(table)
        if published is None or table.snr_db is None or table.runs < 2:
            continue
        least = [100.0 * least_scatter(published[k]) for k in (*printed.LOCALS, printed.GLOCAL)]
        rows = (*table.locals, table.row("glocal"))
        ours = [100.0 * row.EI[0].std / row.EI[0].mean for row in rows]
        yield (
            f"Scatter off the valley at {snr_words(table.snr_db)}",
            f"In the paper d scatters more than the valley allows: its deviations of ε and d imply "
            f"that EI scatters by at least {min(least):.1f} to {max(least):.1f} % between runs "
            f"({float(np.median(least)):.1f} % in the middle). White noise of this ratio on the "
            f"velocities gives {min(ours):.2f} to {max(ours):.2f} % here, so it does not explain "
            f"that; searches that end above the bottom of the valley would, and so would the "
            f"larger noise of velocities that are differentiated from noisy positions.",
        )


def _about_deviation_of_mean(tables: Sequence[EstimateTable]) -> Iterator[Finding]:
    parts = []
    for table in tables:
        published = comparable(table)
        if published is None:
            continue
        each = [published[k][1] for k in printed.LOCALS]
        right, caption = printed.deviation_of_mean(each), printed.caption_deviation(each)
        parts.append(
            f"at {snr_words(table.snr_db)} sqrt(Σ std²)/δ = {right:.4f} and sqrt(Σ std²/δ) = "
            f"{caption:.4f}, printed {published[printed.MEAN][1]:.4f}"
        )
    if parts:
        yield (
            "The deviation of the mean",
            f"From the paper's local deviations of ε (GPa): {'; '.join(parts)}. The printed "
            f"numbers obey the first formula, the caption states the second.",
        )


def _about_sweeps(checked: Validation) -> Finding:
    parts = []
    for level, name in LEVELS.items():
        first, second = checked.mean(level)
        parts.append(f"{name} {first:.2f} and {second:.2f} %")
    return (
        "Validation sweeps",
        f"Average FIT of both velocities over {len(checked.sweeps)} noise-free sweeps, with glocal "
        f"estimates from {snr_words(checked.snr_db)} data: {', '.join(parts)}; the paper has "
        f"{printed.FITS[0]} and {printed.FITS[1]} % with its LPV model. What the LPV model loses "
        f"against the non-linear one is the motion that it neglects; what the rigid arm loses is "
        f"the flexibility.",
    )
