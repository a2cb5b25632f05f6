"""The numbers behind a study's report as CSV tables; SI units unless the heading says another."""

from __future__ import annotations

from collections.abc import Callable

import pandas as pd

from core.montecarlo.agreement import agreements, comparable
from core.montecarlo.summary import Summary
from core.montecarlo.validation import LEVELS
from core.montecarlo.valley import explained, pooled

Frames = dict[str, pd.DataFrame]

TIMES = "baseline_times"
"""The one table that no two runs of a study share to the last digit."""


def study_frames(summary: Summary) -> Frames:
    """File name (without '.csv') -> table; a part that is not finished has none."""
    named: dict[str, Callable[[Summary], pd.DataFrame]] = {
        "estimates": _estimates,
        "runs": _runs,
        "deviation_of_mean": _deviations,
        "beside_the_paper": _beside,
        "valley": _valley,
        "sweeps": _sweeps,
        "baselines": _baselines,
        TIMES: _times,
        "bias": _bias,
        "candidates": _candidates,
        "predicted": _predicted,
    }
    made = {name: make(summary) for name, make in named.items()}
    return {name: frame for name, frame in made.items() if len(frame)}


def _ratio(snr_db: float | None) -> float:
    return float("inf") if snr_db is None else snr_db


def _estimates(s: Summary) -> pd.DataFrame:
    rows = []
    for table in s.tables:
        told = comparable(table)
        for k, row in enumerate(table.rows):
            found: dict[str, object] = {
                "snr_db": _ratio(table.snr_db), "fit": row.label, "theta2": row.theta2,
                "runs": table.runs,
            }  # fmt: skip
            for name, value in row.values.items():
                found |= {f"{name}_mean": value.mean, f"{name}_std": value.std}
            for i, EI in enumerate(row.EI):
                suffix = "" if len(row.EI) == 1 else str(i + 1)
                found |= {f"EI{suffix}_mean": EI.mean, f"EI{suffix}_std": EI.std}
            found["EI_of_means"] = row.EI_of_means
            if told is not None:
                names = ("epsilon_GPa", "epsilon_std_GPa", "d_mm", "d_std_mm")
                found |= {f"paper_{n}": v for n, v in zip(names, told[k], strict=True)}
            rows.append(found)
    return pd.DataFrame(rows)


def _runs(s: Summary) -> pd.DataFrame:
    rows = [
        {"snr_db": _ratio(table.snr_db), "fit": row.label, "run": k + 1, **pair}
        for table in s.tables
        for row in table.rows
        for k, pair in enumerate(row.pairs)
    ]
    return pd.DataFrame(rows)


def _deviations(s: Summary) -> pd.DataFrame:
    rows = [
        (_ratio(t.snr_db), d.name, d.of_mean, d.caption, d.found)
        for t in s.tables
        for d in t.deviations
    ]
    return pd.DataFrame(rows, columns="snr_db quantity of_mean caption found".split())


def _beside(s: Summary) -> pd.DataFrame:
    rows = [
        (_ratio(a.snr_db), a.label, a.name, a.ours, a.paper, a.deviation, a.within)
        for a in agreements(s.tables)
    ]
    names = "snr_db fit quantity here paper paper_std within"
    return pd.DataFrame(rows, columns=names.split())


def _valley(s: Summary) -> pd.DataFrame:
    clean = next((t for t in s.tables if t.snr_db is None), None)
    if clean is None or s.prior is None:
        return pd.DataFrame()
    rows = [
        (e.label, e.name, e.found, e.expected, e.ratio, s.prior.flat[e.name].std)
        for e in (*explained(clean, s.prior), *pooled(clean, s.prior))
    ]
    names = "fit quantity found prior_and_search ratio uniform_prior"
    return pd.DataFrame(rows, columns=names.split())


def _sweeps(s: Summary) -> pd.DataFrame:
    if s.validation is None:
        return pd.DataFrame()
    frame = pd.DataFrame({"sweep": s.validation.sweeps})
    for level in LEVELS:
        for k in range(2):
            frame[f"{level}_fit{k + 1}_percent"] = s.validation.fits[level][:, k]
    return frame


def _baselines(s: Summary) -> pd.DataFrame:
    rows = [
        {
            "points": r.points, "snr_db": _ratio(r.snr_db), "method": r.method,
            **{f"fit_{kind}_percent": value for kind, value in r.fit.items()},
            "pole_error": r.pole_error, "parameters": r.parameters, "result": r.note,
        }
        for r in s.baselines
    ]  # fmt: skip
    return pd.DataFrame(rows)


def _times(s: Summary) -> pd.DataFrame:
    rows = [(r.points, _ratio(r.snr_db), r.method, r.seconds, r.sentence) for r in s.baselines]
    return pd.DataFrame(rows, columns="points snr_db method seconds conclusion".split())


def _bias(s: Summary) -> pd.DataFrame:
    rows = []
    for source in s.bias:
        for draw in range(len(source.local)):
            each = {f"local_{k + 1}": v for k, v in enumerate(source.local[draw])}
            rows.append(
                {
                    "excitation": source.excitation, "rates": source.rates, "draw": draw + 1,
                    **each, "glocal": source.glocal[draw],
                }
            )  # fmt: skip
    return pd.DataFrame(rows)


def _candidates(s: Summary) -> pd.DataFrame:
    if s.planning is None:
        return pd.DataFrame()
    rows = []
    for c in s.planning.candidates:
        found: dict[str, object] = {
            "experiment": c.experiment.name, "theta2": c.experiment.theta2,
            "seconds": c.experiment.seconds, "chosen": c in s.planning.chosen,
        }  # fmt: skip
        for e in c.expected:
            found |= {f"{e.target}_std": e.std, f"{e.target}_bias": e.bias}
        rows.append(found)
    return pd.DataFrame(rows)


def _predicted(s: Summary) -> pd.DataFrame:
    if s.planning is None:
        return pd.DataFrame()
    rows = [(p.label, p.target, p.predicted, p.found) for p in s.planning.predicted]
    return pd.DataFrame(rows, columns="fit target predicted found".split())
