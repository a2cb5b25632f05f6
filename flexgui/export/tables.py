"""The numbers behind the report as CSV tables; units stand in the headings or in a column."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from flexgui.core.diagnose.maps import error_maps
from flexgui.core.results import (
    ChannelComparison,
    Diagnosis,
    ErrorMaps,
    Estimate,
    Outcome,
    RecordingComparison,
)
from flexgui.export.records import as_record
from flexgui.export.result import parameters
from flexgui.views.fit_table import bar_label
from flexgui.views.headline import (
    beside,
    final_comparisons,
    follows,
    given_biased,
    given_comparisons,
    standing,
    standing_biased,
)

LONGEST = 80


def slug(name: str) -> str:
    """Letters, digits, '.', '_' and '-' only, so that any file system takes it."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9._-]+", "_", plain).strip("._-")[:LONGEST] or "unnamed"


def unique_slugs(names: Sequence[str]) -> list[str]:
    """A slug for each name, numbered where two meet (capitals do not tell files apart)."""
    taken: set[str] = set()
    slugs = []
    for name in names:
        base = candidate = slug(name)
        number = 2
        while candidate.lower() in taken:
            candidate = f"{base}_{number}"
            number += 1
        taken.add(candidate.lower())
        slugs.append(candidate)
    return slugs


Tables = dict[str, pd.DataFrame]


def tables(outcome: Outcome) -> Tables:
    """File name (without '.csv') -> table."""
    named: dict[str, Callable[[Outcome], pd.DataFrame]] = {
        "parameters": parameter_table,
        "fit": fit_table,
        "correlation": correlation_table,
        "convergence": convergence_table,
    }
    if outcome.diagnosis is not None:
        named["parameters_as_given"] = parameter_table_as_given
    if outcome.repeated:
        named["repeatability"] = repeatability_table
    made = {name: make(outcome) for name, make in named.items()}
    return made | diagnosis_tables(outcome) | recording_tables(outcome)


REPEATED_COLUMNS = (
    "parameter unit mean lower95 upper95 std_between std_within runs_differing"
).split()


def repeatability_table(outcome: Outcome) -> pd.DataFrame:
    """A row per parameter that several runs of one experiment have estimated, in SI."""
    rows = [
        (
            one.name, one.unit, one.mean, *one.interval, one.between, one.within,
            " ".join(each.run for each in one.disagreeing),
        )
        for one in outcome.repeated
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=REPEATED_COLUMNS)


PARAMETER_COLUMNS = (
    "fit parameter of value std unit start lower upper identifiable at_bound derived recording "
    "biased"
).split()


def parameter_table(outcome: Outcome) -> pd.DataFrame:
    """A row per parameter of the model as it now stands, in the units of the results; without a
    diagnosis a row per fit and parameter."""
    if outcome.diagnosis is None or not outcome.diagnosis.parameters:
        return parameter_table_as_given(outcome)
    biased = standing_biased(outcome)
    found = parameters(outcome, standing(outcome), follows(outcome), biased)
    return _parameter_rows([("the model as it now stands", found)])


def parameter_table_as_given(outcome: Outcome) -> pd.DataFrame:
    """A row per parameter of each first fit."""
    groups = [(fit.label, (*fit.estimates, *fit.derived), fit.derived) for fit in outcome.fits]
    if outcome.as_given:
        groups = [("as given", outcome.as_given, ())]
    biased = given_biased(outcome)
    return _parameter_rows(
        (label, parameters(outcome, estimates, frozenset(e.name for e in derived), biased))
        for label, estimates, derived in groups
    )


def _parameter_rows(found: Iterable[tuple[str, list[dict[str, Any]]]]) -> pd.DataFrame:
    """Of (label of a fit, its parameters as records)."""
    rows = [
        {"fit": label, "parameter": one["name"], **one} for label, each in found for one in each
    ]
    return pd.DataFrame(rows, columns=PARAMETER_COLUMNS)


def fit_table(outcome: Outcome) -> pd.DataFrame:
    """A row per recording and output of the model as it now stands, then of it as given."""
    parts = [
        error_table(comparisons).assign(model=model)
        for model, comparisons in (
            ("as it now stands", final_comparisons(outcome)),
            ("as given", given_comparisons(outcome)),
        )
        if comparisons
    ]
    columns = ["model", *ERROR_COLUMNS]
    return pd.concat(parts, ignore_index=True)[columns] if parts else pd.DataFrame(columns=columns)


ERROR_COLUMNS = (
    "recording role fit channel unit fitted fit_percent rms normalised_error relative_error"
).split()


def error_table(comparisons: Sequence[RecordingComparison]) -> pd.DataFrame:
    """A row per recording and output."""
    rows = [
        {"recording": recording["name"], **recording, **channel}
        for recording in as_record(comparisons)
        for channel in recording["channels"]
    ]
    return pd.DataFrame(rows, columns=ERROR_COLUMNS)


def correlation_table(outcome: Outcome) -> pd.DataFrame:
    """A row per fit and pair of parameters."""
    rows = [
        (fit.label, _own_name(a), _own_name(b), fit.correlation[i, j])
        for fit in outcome.fits
        for i, a in enumerate(fit.estimates)
        for j, b in enumerate(fit.estimates)
    ]
    return pd.DataFrame(rows, columns=["fit", "parameter", "other", "correlation"])


def _own_name(estimate: Estimate) -> str:
    return f"{estimate.name} ({estimate.recording})" if estimate.recording else estimate.name


def convergence_table(outcome: Outcome) -> pd.DataFrame:
    """A row per fit and generation, with the best member's parameters."""
    rows = [
        {
            "fit": fit.label,
            "generation": g.number,
            "best": g.best,
            "mean": g.mean,
            "worst": g.worst,
            **dict(zip((_own_name(e) for e in fit.estimates), g.best_vector, strict=False)),
        }
        for fit in outcome.fits
        for g in fit.convergence
    ]
    return pd.DataFrame(rows) if rows else pd.DataFrame(columns=["fit", "generation", "best"])


def recording_tables(outcome: Outcome) -> Tables:
    """A table per recording: time and, per output, measured, model, residual, counted; and the
    model as given beside them where it has changed since."""
    shown, before = final_comparisons(outcome), given_comparisons(outcome)
    slugs = unique_slugs([bar_label(r, shown) for r in shown])
    return {
        f"recording_{slug}": recording_table(recording, beside(recording, before))
        for slug, recording in zip(slugs, shown, strict=True)
    }


def recording_table(
    recording: RecordingComparison, before: RecordingComparison | None = None
) -> pd.DataFrame:
    """One row per time; an empty cell is 'no sample'."""
    parts = [
        pd.DataFrame(
            {
                **_values(channel, "measured", "model", "residual"),
                f"{channel.channel} counted": channel.counted.astype(int),
            },
            index=channel.time,
        )
        for channel in recording.channels
    ]
    for channel in before.channels if before is not None else ():
        columns = _values(channel, "model", "residual", which=" as given")
        parts.append(pd.DataFrame(columns, index=channel.time))
    joined = pd.concat(parts, axis=1) if recording.channels else pd.DataFrame()
    return joined.rename_axis("t [s]").sort_index().reset_index()


def _values(channel: ChannelComparison, *names: str, which: str = "") -> dict[str, np.ndarray]:
    """Heading with unit -> a field of an output."""
    unit = channel.unit or "-"
    return {f"{channel.channel} {n}{which} [{unit}]": getattr(channel, n) for n in names}


def diagnosis_tables(outcome: Outcome) -> Tables:
    """File name (without '.csv') -> table; none where nothing was diagnosed."""
    found = outcome.diagnosis
    if found is None:
        return {}
    maps = error_maps(found.given or outcome.comparisons, found.floors)
    return {
        "ladder": ladder_table(found),
        "ranking": ranking_table(found),
        "error_map": error_map_table(maps),
    }


LADDER_COLUMNS = "step added channel unit rms floor floor_source validation_rms".split()


def ladder_table(found: Diagnosis) -> pd.DataFrame:
    """A row per step and output, in SI units."""
    rows = [
        {"step": k, "added": step.added, **error}
        for k, step in enumerate(found.steps)
        for error in as_record(step.errors)
    ]
    return pd.DataFrame(rows, columns=LADDER_COLUMNS)


RANKING_COLUMNS = (
    "round effect score p_value expected_drop_percent refit_drop_percent delta_bic confused_with "
    "accepted"
).split()


def ranking_table(found: Diagnosis) -> pd.DataFrame:
    """A row per round and candidate."""
    rows = [
        {
            "round": k,
            **as_record(effect),
            "confused_with": " ".join(effect.confused_with),
            "accepted": effect.effect == one.accepted,
        }
        for k, one in enumerate(found.rounds, start=1)
        for effect in one.ranking
    ]
    return pd.DataFrame(rows, columns=RANKING_COLUMNS)


ERROR_MAP_COLUMNS = "channel unit recording axis axis_unit low high rms floor".split()


def error_map_table(maps: ErrorMaps) -> pd.DataFrame:
    """A row per output, recording and time window or frequency band."""
    rows = [
        (
            m.channel, m.unit, name, m.axis, m.axis_unit,
            m.edges[j], m.edges[j + 1], m.rms[i, j], m.floor[i, j],
        )
        for m in (*maps.by_time, *maps.by_frequency)
        for i, name in enumerate(m.recordings)
        for j in range(len(m.edges) - 1)
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=ERROR_MAP_COLUMNS)
