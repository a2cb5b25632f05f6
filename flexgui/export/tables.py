"""The numbers behind the report as CSV tables; units stand in the headings or in a column."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pandas as pd

from core.results import ChannelComparison, Estimate, Fit, Outcome, RecordingComparison
from flexgui.export.diagnosis_tables import diagnosis_tables
from flexgui.export.filenames import unique_slugs
from flexgui.views.fit_bars import bar_label

Tables = dict[str, pd.DataFrame]


def tables(outcome: Outcome) -> Tables:
    """File name (without '.csv') -> table."""
    named: dict[str, Callable[[Outcome], pd.DataFrame]] = {
        "parameters": parameter_table,
        "fit": fit_table,
        "correlation": correlation_table,
        "convergence": convergence_table,
    }
    made = {name: make(outcome) for name, make in named.items()}
    return made | diagnosis_tables(outcome) | recording_tables(outcome)


def parameter_table(outcome: Outcome) -> pd.DataFrame:
    """A row per fit and parameter, in the units of the results."""
    rows = [
        _estimate(fit, estimate, derived)
        for fit in outcome.fits
        for derived, group in ((False, fit.estimates), (True, fit.derived))
        for estimate in group
    ]
    columns = "fit parameter value std unit start lower upper identifiable at_bound derived"
    return pd.DataFrame(rows, columns=[*columns.split(), "recording"])


def _estimate(fit: Fit, estimate: Estimate, derived: bool) -> dict[str, object]:
    return {
        "fit": fit.label,
        "parameter": estimate.name,
        "value": estimate.value,
        "std": estimate.std,
        "unit": estimate.unit,
        "start": estimate.start,
        "lower": estimate.lower,
        "upper": estimate.upper,
        "identifiable": estimate.identifiable,
        "at_bound": estimate.at_bound,
        "derived": derived,
        "recording": estimate.recording,
    }


def fit_table(outcome: Outcome) -> pd.DataFrame:
    """A row per recording and output."""
    rows = [
        {
            "recording": recording.recording,
            "role": recording.role,
            "fit": recording.fit_label,
            "channel": channel.channel,
            "unit": channel.unit,
            "fitted": channel.fitted,
            "fit_percent": channel.fit_percent,
            "rms": channel.rms,
            "normalised_error": channel.normalised_error,
            "relative_error": channel.relative_error,
        }
        for recording in outcome.comparisons
        for channel in recording.channels
    ]
    columns = "recording role fit channel unit fitted fit_percent rms normalised_error"
    return pd.DataFrame(rows, columns=[*columns.split(), "relative_error"])


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
    """A table per recording: time and, per output, measured, model, residual, counted."""
    labels = [bar_label(r, outcome.comparisons) for r in outcome.comparisons]
    slugs = unique_slugs(labels)
    return {
        f"recording_{slug}": recording_table(recording)
        for slug, recording in zip(slugs, outcome.comparisons, strict=True)
    }


def recording_table(recording: RecordingComparison) -> pd.DataFrame:
    """One row per time; an empty cell is 'no sample'."""
    parts: Iterable[pd.DataFrame] = [_channel(channel) for channel in recording.channels]
    joined = pd.concat(list(parts), axis=1) if recording.channels else pd.DataFrame()
    return joined.rename_axis("t [s]").sort_index().reset_index()


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
