"""Models compared on the same data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.results import Outcome, RecordingComparison
from flexgui.views.fit_bars import bar_label
from flexgui.views.fit_table import ROLES
from flexgui.views.names import channel_symbol
from flexgui.views.numbers import format_number
from flexgui.views.pooled import mean
from flexgui.views.table import Column, Row, Table

Key = tuple[str, str, str]
"""Recording, role, output."""
Errors = dict[Key, float]


def variants(outcome: Outcome) -> Table | None:
    """The normalised error per recording and output, a column per model; None without others.

    The outputs are those that the scenario's own model was fitted to.
    """
    if not outcome.variants:
        return None
    titles = ["this model", *(variant.title for variant in outcome.variants)]
    errors = [_errors(outcome.comparisons), *(_errors(v.comparisons) for v in outcome.variants)]
    keys = list(errors[0]) or list(dict.fromkeys(k for e in errors for k in e))
    columns = (Column("Recording"), Column("Role"), Column("Output"))
    rows = [_row(key, [e.get(key, float("nan")) for e in errors]) for key in keys]
    return Table(
        columns + tuple(Column(text, numeric=True) for text in titles),
        (*_means(keys, errors), *rows),
        "Normalised error ‖measured − model‖ / ‖measured − its mean‖, no unit; the least of each "
        "row is coloured. Rows of all recordings hold the mean.",
    )


def _means(keys: Sequence[Key], errors: Sequence[Errors]) -> list[Row]:
    groups: dict[tuple[str, str], list[Key]] = {}
    for key in keys:
        groups.setdefault(key[1:], []).append(key)
    return [
        _row(
            (f"all {len(group)}", *kind),
            [mean([e.get(key, float("nan")) for key in group]) for e in errors],
            strong=True,
        )
        for kind, group in groups.items()
        if len(group) > 1
    ]


def _errors(comparisons: Sequence[RecordingComparison]) -> Errors:
    return {
        (bar_label(r, comparisons), r.role, c.channel): c.normalised_error
        for r in comparisons
        for c in r.channels
        if c.fitted
    }


def _row(key: Key, values: Sequence[float], strong: bool = False) -> Row:
    recording, role, channel = key
    heads = (recording, ROLES.get(role, role), channel_symbol(channel))
    best = len(heads) + int(np.nanargmin(values)) if np.isfinite(values).any() else None
    return Row(heads + tuple(format_number(v, 3, keep_zeros=True) for v in values), strong, best)
