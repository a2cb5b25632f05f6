"""What follows from the figures of a study, in words; the findings' sentences stand in
`export/templates/findings.txt.j2`, and every one is made of numbers that were found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from flexgui.core.montecarlo.estimates import (
    WITHIN,
    EstimateTable,
    agreements,
    comparable,
    explained,
    implied_bias,
    least_scatter,
    pooled,
)
from flexgui.core.montecarlo.paper_values import FITS, LOCALS, caption_deviation, deviation_of_mean
from flexgui.core.montecarlo.paper_values import GLOCAL as PAPERS_GLOCAL
from flexgui.core.montecarlo.summary import LEVELS, BaselineRow, Summary
from flexgui.core.sentences import listed
from flexgui.export.template import program
from flexgui.sentences.written import format_number
from flexgui.stages.study.plots_estimates import plus, snr

Finding = tuple[str, str]
"""Heading and paragraph."""

LIKELY = 2.0
"""Root mean squares: a bias within so many is one that a draw of the excitation may well give."""


def findings(s: Summary) -> list[Finding]:
    """As many as the finished parts allow, in the order of a report."""
    clean = next((t for t in s.tables if t.snr_db is None and t.runs > 1), None)
    pool = pooled(clean, s.prior) if clean and s.prior else ()
    text = program(
        "findings.txt",
        s=s,
        clean=clean,
        both=[(t, published) for t in s.tables if (published := comparable(t)) is not None],
        means=agreements(s.tables),
        pool={e.name: e for e in pool},
        **_of_bias(s),
        **_of_baselines(s.baselines),
        **_of_planning(s),
        **HELP,
    )
    parts = (part.partition("\n") for part in f"\n{text}".split("\n# ")[1:])
    return [(heading, " ".join(words.split())) for heading, _, words in parts]


def ratio_of_deviations(table: EstimateTable) -> float:
    """Smallest over the fits: relative deviation of ε over that of EI."""
    ratios = []
    for row in (*table.locals, table.row("glocal")):
        epsilon, EI = row.values["epsilon"], row.EI[0]
        ratios.append((epsilon.std / epsilon.mean) / max(EI.std / EI.mean, 1e-300))
    return min(ratios)


def _of_bias(s: Summary) -> dict[str, Any]:
    """Per cent by which EI is wrong: as the paper's means imply, as found here, as explained."""
    sources = {(spread.excitation, spread.rates): spread for spread in s.bias}
    kinds = (("prbs", "tip"), ("prbs", "working point"), ("prbs_balanced", "tip"))
    plain, paper, still = (sources.get(kind) for kind in kinds)
    rows = s.tables[0].rows if s.tables else ()
    return {
        "plain": plain,
        "paper": paper,
        "still": still,
        "implied": lambda numbers: 100.0 * implied_bias(numbers, s.true_EI),
        "ours": [100.0 * (row.EI[0].mean / s.true_EI - 1.0) for row in rows],
        "curved": [100.0 * (row.EI_of_means / row.EI[0].mean - 1.0) for row in rows],
        "scatters": lambda published: [
            100.0 * least_scatter(published[k]) for k in (*LOCALS, PAPERS_GLOCAL)
        ],
        "own_scatters": lambda table: [
            100.0 * row.EI[0].std / row.EI[0].mean for row in (*table.locals, table.row("glocal"))
        ],
        "unlikely": lambda table, published: [
            f"{table.rows[k].label} ({format_number(abs(times), 2)} rms)"
            for k in LOCALS
            if paper and abs(times := implied_bias(published[k], s.true_EI) / paper.rms[k]) > LIKELY
        ],
    }


def _of_baselines(rows: Sequence[BaselineRow]) -> dict[str, Any]:
    """How often each method is best, and by how much glocal is ahead or behind."""
    cells: dict[tuple[int, float | None], dict[str, BaselineRow]] = {}
    for row in rows:
        cells.setdefault((row.points, row.snr_db), {})[row.method] = row
    findings = list(cells.values())
    linear = [{k: v for k, v in cell.items() if k != NONLINEAR} for cell in findings]
    counted = [(words, _beaten(findings, kind)) for kind, (*_, words) in KINDS.items()]
    others = [name for name in (findings[0] if findings else ()) if name != GLOCAL]
    return {
        "cells": len(cells),
        "counted": [*counted, ("on sweeps among the linear models", _beaten(linear, "sweeps"))],
        "others": [
            (name, *zip(*(_ahead(c[name], c[GLOCAL]) for c in findings if name in c), strict=True))
            for name in others
        ],
    }


def _beaten(cells: Sequence[Mapping[str, BaselineRow]], kind: str) -> list[str]:
    """Who is better than glocal, cell by cell."""
    tops = [max(cell.values(), key=lambda row: row.fit[kind]) for cell in cells]
    pairs = zip(tops, cells, strict=True)
    return [top.method for top, cell in pairs if cell[GLOCAL].fit[kind] < top.fit[kind] - EQUAL]


def _ahead(other: BaselineRow, glocal: BaselineRow) -> tuple[float, float, float]:
    """Points of FIT on sweeps that glocal gains; how many times nearer its poles are, and how many
    times as long the other takes."""
    return (
        glocal.fit["sweeps"] - other.fit["sweeps"],
        other.pole_error / max(glocal.pole_error, 1e-300),
        other.seconds / glocal.seconds,
    )


def _of_planning(s: Summary) -> dict[str, Any]:
    """Of the best experiments: where, and how well predictions held."""
    if s.planning is None:
        return {}
    chosen = [c.experiment for c in s.planning.chosen]
    angles = sorted({round(float(np.degrees(e.theta2))) for e in chosen})
    return {
        "kinds": sorted({e.name for e in chosen}),
        "angles": [f"{angle}°" for angle in angles],
        "noise": [f"{std:.4f}" for std in s.planning.noise],
        "ratios": [p.ratio for p in s.planning.predicted if np.isfinite(p.found)],
    }


def _mean_and_error(draws: np.ndarray) -> str:
    """'+2.1 ± 2.4' in %."""
    error = 100.0 * float(draws.std(ddof=1)) / np.sqrt(len(draws)) if len(draws) > 1 else 0.0
    return f"{plus(100.0 * float(draws.mean()), 1)} ± {error:.1f}"


GLOCAL, NONLINEAR = "glocal", "non-linear output error"
KINDS = {
    "identified": ("at its own points", "its own points", "at identified working points"),
    "unseen": ("at unseen points", "unseen points", "at unseen working points"),
    "sweeps": ("on sweeps", "sweeps", "on sweeps"),
}
"""Kind of recordings -> how it is called in a method's sentence, in glocal's, in the count."""

EQUAL = 0.05
"""% of FIT: a difference below this is none."""
EQUAL_SHARE = 0.02
"""Of a pole error or a time: likewise."""


def result_text(row: BaselineRow) -> str:
    """What a method found, in a few words."""
    if "order" in row.found:
        return f"order {row.found['order']}, degree {row.found['degree']} in cos θ₂"
    return "EI " + ", ".join(f"{EI:.2f}" for EI in row.found["EI"]) + " N m²"


def conclusions(rows: Sequence[BaselineRow]) -> list[str]:
    """Each row against glocal at the same points and SNR; glocal against the best of the others."""
    findings = []
    for row in rows:
        same = [r for r in rows if (r.points, r.snr_db) == (row.points, row.snr_db)]
        others = [r for r in same if r.method != row.method]
        glocal = next((r for r in others if r.method == GLOCAL), None)
        if row.method == GLOCAL:
            findings.append(_of_glocal(row, others))
        else:
            findings.append("" if glocal is None else _beside(row, glocal))
    return findings


def _beside(row: BaselineRow, glocal: BaselineRow) -> str:
    ahead: list[str] = []
    behind: list[str] = []
    for kind, (words, *_) in KINDS.items():
        gain = row.fit[kind] - glocal.fit[kind]
        if abs(gain) > EQUAL:
            (ahead if gain > 0 else behind).append(f"{abs(gain):.2f} points of FIT {words}")
    poles = row.pole_error, glocal.pole_error
    if abs(poles[0] - poles[1]) > EQUAL_SHARE * max(poles):
        times = max(poles) / max(min(poles), 1e-300)
        worse = poles[0] > poles[1]
        (behind if worse else ahead).append(
            f"poles {format_number(times, 3)} times {'as wrong' if worse else 'as near'}"
        )
    return f"{_verdict(ahead, behind)} {_effort(row, glocal)}"


def _verdict(ahead: Sequence[str], behind: Sequence[str]) -> str:
    if not ahead and not behind:
        return "As good as glocal."
    if not behind:
        return f"Better than glocal: {', '.join(ahead)}."
    if not ahead:
        return f"Worse than glocal: {', '.join(behind)}."
    return f"Better than glocal in {', '.join(ahead)}; worse in {', '.join(behind)}."


def _effort(row: BaselineRow, glocal: BaselineRow) -> str:
    times = row.seconds / glocal.seconds
    time = f"{times:.1f} times the time" if times >= 1.0 else f"{1.0 / times:.1f} times as fast"
    if row.parameters == glocal.parameters:
        return f"As many parameters, {time}."
    return f"{row.parameters} numbers instead of {glocal.parameters}, {time}."


def _of_glocal(row: BaselineRow, others: Sequence[BaselineRow]) -> str:
    won, lost = [], []
    for kind, (_, words, _) in KINDS.items():
        best = max(others, key=lambda r: r.fit[kind])
        gain = row.fit[kind] - best.fit[kind]
        if gain < -EQUAL:
            lost.append(f"{words} ({best.method}, by {-gain:.2f} points)")
        elif gain > EQUAL:
            won.append(f"{words} (by {gain:.2f} points)")
    nearest = min(others, key=lambda r: r.pole_error)
    if row.pole_error < (1.0 - EQUAL_SHARE) * nearest.pole_error:
        won.append("poles")
    elif row.pole_error > (1.0 + EQUAL_SHARE) * nearest.pole_error:
        times = row.pole_error / max(nearest.pole_error, 1e-300)
        lost.append(f"poles ({nearest.method}, {format_number(times, 3)} times as near)")
    first = f"Best on {', '.join(won)}." if won else "Best in no measure alone."
    return f"{first} Worse in {', '.join(lost)}." if lost else f"{first} Worse in no measure."


HELP: dict[str, Any] = {
    **{one.__name__: one for one in (
        caption_deviation, comparable, deviation_of_mean, explained, listed, plus, snr,
    )},
    "ratio_of_deviations": ratio_of_deviations, "mean_and_error": _mean_and_error,
    "number": partial(format_number, digits=2), "median": np.median, "degrees": np.degrees,
    "rms": lambda x: np.sqrt(np.mean(np.square(x))),
    "WITHIN": WITHIN, "LIKELY": LIKELY, "EQUAL": EQUAL, "LEVELS": LEVELS, "FITS": FITS,
}  # fmt: skip
"""What the template of the findings asks and states."""
