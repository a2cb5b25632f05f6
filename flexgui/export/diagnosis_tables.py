"""The numbers of a diagnosis as CSV tables."""

from __future__ import annotations

import pandas as pd

from core.diagnose.maps import error_maps
from core.results import Outcome


def diagnosis_tables(outcome: Outcome) -> dict[str, pd.DataFrame]:
    """File name (without '.csv') -> table; none where nothing was diagnosed."""
    if outcome.diagnosis is None:
        return {}
    return {
        "ladder": ladder_table(outcome),
        "ranking": ranking_table(outcome),
        "error_map": error_map_table(outcome),
    }


def ladder_table(outcome: Outcome) -> pd.DataFrame:
    """A row per step and output, in SI units."""
    assert outcome.diagnosis is not None
    rows = [
        {
            "step": k,
            "added": step.added,
            "channel": e.channel,
            "unit": e.unit,
            "rms": e.rms,
            "floor": e.floor,
            "floor_source": e.floor_source or None,
            "validation_rms": e.validation_rms,
        }
        for k, step in enumerate(outcome.diagnosis.steps)
        for e in step.errors
    ]
    return pd.DataFrame(
        rows, columns="step added channel unit rms floor floor_source validation_rms".split()
    )


def ranking_table(outcome: Outcome) -> pd.DataFrame:
    """A row per round and candidate."""
    assert outcome.diagnosis is not None
    rows = [
        {
            "round": k,
            "effect": r.effect,
            "score": r.score,
            "p_value": r.p_value,
            "expected_drop_percent": r.expected_drop_percent,
            "refit_drop_percent": r.refit_drop_percent,
            "delta_bic": r.delta_bic,
            "confused_with": " ".join(r.confused_with),
            "accepted": r.effect == one.accepted,
        }
        for k, one in enumerate(outcome.diagnosis.rounds, start=1)
        for r in one.ranking
    ]
    columns = "round effect score p_value expected_drop_percent refit_drop_percent delta_bic"
    return pd.DataFrame(rows, columns=[*columns.split(), "confused_with", "accepted"])


def error_map_table(outcome: Outcome) -> pd.DataFrame:
    """A row per output, recording and time window or frequency band."""
    assert outcome.diagnosis is not None
    maps = error_maps(outcome.diagnosis.given or outcome.comparisons, outcome.diagnosis.floors)
    rows = [
        {
            "channel": m.channel,
            "unit": m.unit,
            "recording": name,
            "axis": m.axis,
            "axis_unit": m.axis_unit,
            "low": m.edges[j],
            "high": m.edges[j + 1],
            "rms": m.rms[i, j],
            "floor": m.floor[i, j],
        }
        for m in (*maps.by_time, *maps.by_frequency)
        for i, name in enumerate(m.recordings)
        for j in range(len(m.edges) - 1)
    ]
    columns = "channel unit recording axis axis_unit low high rms floor"
    return pd.DataFrame(rows, columns=columns.split())
