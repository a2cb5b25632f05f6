"""The numbers behind the report as CSV tables; units stand in the headings or in a column."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import pandas as pd

from flexgui.core.diagnose.maps import error_maps
from flexgui.core.results import ChannelComparison, Estimate, Outcome, RecordingComparison
from flexgui.views.fit_table import bar_label
from flexgui.views.headline import (
    belongs_to,
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


def fields_of(record: object, names: str) -> dict[str, Any]:
    """Fields of a record under their own names, which stand between blanks."""
    return {name: getattr(record, name) for name in names.split()}


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
    derived, biased = follows(outcome), standing_biased(outcome)
    rows = [_estimate(outcome, STANDING, e, e.name in derived, biased) for e in standing(outcome)]
    return pd.DataFrame(rows, columns=PARAMETER_COLUMNS)


STANDING = "the model as it now stands"


def parameter_table_as_given(outcome: Outcome) -> pd.DataFrame:
    """A row per parameter of each first fit."""
    biased = given_biased(outcome)
    groups = [
        (fit.label, derived, group)
        for fit in outcome.fits
        for derived, group in ((False, fit.estimates), (True, fit.derived))
    ]
    if outcome.as_given:
        groups = [("as given", False, outcome.as_given)]
    rows = [
        _estimate(outcome, label, estimate, derived, biased)
        for label, derived, group in groups
        for estimate in group
    ]
    return pd.DataFrame(rows, columns=PARAMETER_COLUMNS)


def _estimate(
    outcome: Outcome, fit: str, estimate: Estimate, derived: bool, biased: bool
) -> dict[str, object]:
    return {
        "fit": fit,
        "parameter": estimate.name,
        "of": belongs_to(outcome, estimate.name),
        **fields_of(estimate, "value std unit start lower upper identifiable at_bound"),
        "derived": derived,
        "recording": estimate.recording,
        "biased": biased,
    }


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


ERROR_FIELDS = "channel unit fitted fit_percent rms normalised_error relative_error"
ERROR_COLUMNS = f"recording role fit {ERROR_FIELDS}".split()


def error_table(comparisons: Sequence[RecordingComparison]) -> pd.DataFrame:
    """A row per recording and output."""
    rows = [
        {
            "recording": recording.recording,
            "role": recording.role,
            "fit": recording.fit_label,
            **fields_of(channel, ERROR_FIELDS),
        }
        for recording in comparisons
        for channel in recording.channels
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
    parts: Iterable[pd.DataFrame] = [_channel(channel) for channel in recording.channels]
    if before is not None:
        parts = [*parts, *(_as_given(channel) for channel in before.channels)]
    joined = pd.concat(list(parts), axis=1) if recording.channels else pd.DataFrame()
    return joined.rename_axis("t [s]").sort_index().reset_index()


def _as_given(channel: ChannelComparison) -> pd.DataFrame:
    name, unit = channel.channel, channel.unit or "-"
    values = {
        f"{name} model as given [{unit}]": channel.model,
        f"{name} residual as given [{unit}]": channel.residual,
    }
    return pd.DataFrame(values, index=channel.time)


def _channel(channel: ChannelComparison) -> pd.DataFrame:
    name, unit = channel.channel, channel.unit or "-"
    return pd.DataFrame(
        {
            f"{name} measured [{unit}]": channel.measured,
            f"{name} model [{unit}]": channel.model,
            f"{name} residual [{unit}]": channel.residual,
            f"{name} counted": channel.counted.astype(int),
        },
        index=channel.time,
    )


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
            **fields_of(e, "channel unit rms floor"),
            "floor_source": e.floor_source or None,
            "validation_rms": e.validation_rms,
        }
        for k, step in enumerate(outcome.diagnosis.steps)
        for e in step.errors
    ]
    return pd.DataFrame(
        rows, columns="step added channel unit rms floor floor_source validation_rms".split()
    )


RANKING_FIELDS = "effect score p_value expected_drop_percent refit_drop_percent delta_bic"


def ranking_table(outcome: Outcome) -> pd.DataFrame:
    """A row per round and candidate."""
    assert outcome.diagnosis is not None
    rows = [
        {
            "round": k,
            **fields_of(r, RANKING_FIELDS),
            "confused_with": " ".join(r.confused_with),
            "accepted": r.effect == one.accepted,
        }
        for k, one in enumerate(outcome.diagnosis.rounds, start=1)
        for r in one.ranking
    ]
    columns = f"round {RANKING_FIELDS} confused_with accepted"
    return pd.DataFrame(rows, columns=columns.split())


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
