"""The numbers of the report as CSV tables; units are in the headings or in a column."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise, product
from typing import Any

import numpy as np
import pandas as pd

from flexgui.core.error_maps import error_maps
from flexgui.core.residual_analysis import ResidualAnalysis, residual_analysis
from flexgui.core.results import ChannelComparison, Outcome, RecordingComparison
from flexgui.export.result import as_record, parameters
from flexgui.views.fit_table import bar_label
from flexgui.views.headline import (
    comparisons_as_given,
    final_comparisons,
    final_derived_names,
    final_estimates,
    final_is_biased,
    first_is_biased,
    of_same_recording,
)
from flexgui.views.parameter_tables import changes

LONGEST_FILE_NAME = 80


def slug(name: str) -> str:
    """Letters, digits, '.', '_' and '-' only, so that any file system takes it."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9._-]+", "_", plain).strip("._-")[:LONGEST_FILE_NAME] or "unnamed"


def unique_slugs(names: Sequence[str]) -> list[str]:
    """A unique slug for each name, numbered if needed; case is ignored."""
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


Rows = Iterator[dict[str, Any]]


def parameter_rows(outcome: Outcome) -> Rows:
    """A row per final parameter, in the results' units; without a diagnosis per fit."""
    if outcome.diagnosis is None or not outcome.diagnosis.parameters:
        yield from parameter_rows_as_given(outcome)
        return
    biased = final_is_biased(outcome)
    for row in parameters(outcome, final_estimates(outcome), final_derived_names(outcome), biased):
        yield {"fit": "the model as it now stands", "parameter": row["name"], **row}


def parameter_rows_as_given(outcome: Outcome) -> Rows:
    """A row per parameter of each first fit."""
    groups = [(fit.label, (*fit.estimates, *fit.derived), fit.derived) for fit in outcome.fits]
    if outcome.as_given:
        groups = [("as given", outcome.as_given, ())]
    for label, estimates, derived in groups:
        names = frozenset(e.name for e in derived)
        for row in parameters(outcome, estimates, names, first_is_biased(outcome)):
            yield {"fit": label, "parameter": row["name"], **row}


def error_rows(comparisons: Sequence[RecordingComparison]) -> Rows:
    """A row per recording and output."""
    for recording in as_record(comparisons):
        for channel in recording["channels"]:
            yield {"recording": recording["name"], **recording, **channel}


def fit_rows(outcome: Outcome) -> Rows:
    """The same for the model after the diagnosis, then as given."""
    yield from (
        {"model": "as it now stands", **row} for row in error_rows(final_comparisons(outcome))
    )
    yield from ({"model": "as given", **row} for row in error_rows(comparisons_as_given(outcome)))


def correlation_rows(outcome: Outcome) -> Rows:
    """A row per fit and pair of parameters."""
    for fit in outcome.fits:
        names = [e.label for e in fit.estimates]
        for (i, a), (j, b) in product(enumerate(names), repeat=2):
            rho = fit.correlation[i, j]
            yield {"fit": fit.label, "parameter": a, "other": b, "correlation": rho}


def repeatability_rows(outcome: Outcome) -> Rows:
    """A row per parameter estimated in several runs of one experiment, in SI."""
    for repeated in outcome.repeated:
        yield {
            "parameter": repeated.name,
            "unit": repeated.unit,
            "mean": repeated.mean,
            "lower95": repeated.interval[0],
            "upper95": repeated.interval[1],
            "std_between": repeated.between,
            "std_within": repeated.within,
            "runs_differing": " ".join(each.run for each in repeated.disagreeing),
        }


def change_rows(outcome: Outcome) -> Rows:
    """A row per parameter, of the model as given and of the last one."""
    diagnosis = outcome.diagnosis
    for each in changes(diagnosis.steps, diagnosis.parameters) if diagnosis else ():
        row: dict[str, Any] = {"parameter": each.of.name, "unit": each.of.unit}
        for which, e in (("as_given", each.before), ("now", each.after)):
            row |= {} if e is None else {which: e.value, f"std_{which}": e.std}
        yield row | {"change_in_std": each.in_std}


def ladder_rows(outcome: Outcome) -> Rows:
    """A row per step and output, in SI units."""
    for k, step in enumerate(outcome.diagnosis.steps if outcome.diagnosis else ()):
        for error in as_record(step.errors):
            yield {"step": k, "added": step.added, **error}


def ranking_rows(outcome: Outcome) -> Rows:
    """A row per round and candidate."""
    rounds = outcome.diagnosis.rounds if outcome.diagnosis else ()
    for k, searched in enumerate(rounds, start=1):
        for effect in searched.ranking:
            confused = " ".join(effect.confused_with)
            accepted = effect.effect == searched.accepted
            yield {
                "round": k, **as_record(effect), "confused_with": confused, "accepted": accepted
            }  # fmt: skip


def error_map_rows(outcome: Outcome) -> Rows:
    """A row per output, recording and time window or frequency band."""
    diagnosis = outcome.diagnosis
    given = outcome.comparisons if diagnosis is None else diagnosis.given or outcome.comparisons
    maps = None if diagnosis is None else error_maps(given, diagnosis.floors)
    for m in (*maps.by_time, *maps.by_frequency) if maps else ():
        named = {"channel": m.channel, "unit": m.unit, "axis": m.axis, "axis_unit": m.axis_unit}
        for (i, name), (j, edges) in product(enumerate(m.recordings), enumerate(pairwise(m.edges))):
            low, high = edges
            cell = {"low": low, "high": high, "rms": m.rms[i, j], "floor": m.floor[i, j]}
            yield {**named, "recording": name, **cell}


def residual_rows(found: ResidualAnalysis) -> Rows:
    """A row per correlation: how many lags are outside its band, and the worst one in s."""
    for c in found.correlations:
        worst = c.worst
        yield {
            "recording": c.recording, "channel": c.channel, "with": c.input or "itself",
            "outside": c.outside, "lag": c.lag[worst], "value": c.value[worst],
            "band": c.band[worst],
        }  # fmt: skip


RESIDUALS = "recording channel with outside lag value band"
ERRORS = "recording role fit channel unit fitted fit_percent rms normalised_error relative_error"
PARAMETERS = (
    "fit parameter of value std unit start lower upper identifiable at_bound derived recording "
    "biased"
)
TABLES: Mapping[str, tuple[str, Callable[[Outcome], Rows]]] = {
    "parameters": (PARAMETERS, parameter_rows),
    "fit": (f"model {ERRORS}", fit_rows),
    "correlation": ("fit parameter other correlation", correlation_rows),
    "parameters_as_given": (PARAMETERS, parameter_rows_as_given),
    "repeatability": (
        "parameter unit mean lower95 upper95 std_between std_within runs_differing",
        repeatability_rows,
    ),
    "ladder": ("step added channel unit rms floor floor_source validation_rms", ladder_rows),
    "changes": ("parameter unit as_given std_as_given now std_now change_in_std", change_rows),
    "ranking": (
        "round effect score p_value expected_drop_percent refit_drop_percent delta_bic "
        "confused_with accepted",
        ranking_rows,
    ),
    "error_map": ("channel unit recording axis axis_unit low high rms floor", error_map_rows),
}
"""Name -> its columns, which stand between blanks, and its rows."""

OF_A_DIAGNOSIS = ("ladder", "changes", "ranking", "error_map")


def table(outcome: Outcome, name: str) -> pd.DataFrame:
    """One of TABLES."""
    columns, rows = TABLES[name]
    return pd.DataFrame(list(rows(outcome)), columns=columns.split())


def error_table(comparisons: Sequence[RecordingComparison]) -> pd.DataFrame:
    """A row per recording and output."""
    return pd.DataFrame(list(error_rows(comparisons)), columns=ERRORS.split())


def residual_table(found: ResidualAnalysis) -> pd.DataFrame:
    """A row per recording, output and what its residual is correlated with."""
    return pd.DataFrame(list(residual_rows(found)), columns=RESIDUALS.split())


def tables(outcome: Outcome) -> dict[str, pd.DataFrame]:
    """File name (without '.csv') -> table."""
    names = ["parameters", "fit", "correlation"]
    if outcome.diagnosis is not None:
        names += ["parameters_as_given", *OF_A_DIAGNOSIS]
    if outcome.repeated:
        names.append("repeatability")
    made = {name: table(outcome, name) for name in names}
    made["residual_analysis"] = residual_table(residual_analysis(final_comparisons(outcome)))
    return {**made, "convergence": convergence_table(outcome), **recording_tables(outcome)}


def convergence_table(outcome: Outcome) -> pd.DataFrame:
    """A row per fit and generation, with the best member's parameters."""
    rows = [
        {"fit": fit.label, "generation": g.number, "best": g.best, "mean": g.mean, "worst": g.worst}
        | dict(zip((e.label for e in fit.estimates), g.best_vector, strict=False))
        for fit in outcome.fits
        for g in fit.convergence
    ]
    return pd.DataFrame(rows) if rows else pd.DataFrame(columns=["fit", "generation", "best"])


def recording_tables(outcome: Outcome) -> dict[str, pd.DataFrame]:
    """A table per recording: time and, per output, measured, model, residual, counted."""
    shown, before = final_comparisons(outcome), comparisons_as_given(outcome)
    slugs = unique_slugs([bar_label(r, shown) for r in shown])
    return {
        f"recording_{slug}": recording_table(recording, of_same_recording(recording, before))
        for slug, recording in zip(slugs, shown, strict=True)
    }


def recording_table(
    recording: RecordingComparison, before: RecordingComparison | None = None
) -> pd.DataFrame:
    """One row per time; an empty cell means 'no sample'."""
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
