"""Where the model fails, worked out once for all who look at a session."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexgui.core.results import ErrorMaps, RecordingComparison
from flexgui.views.error_map import ErrorNow, error_now
from flexgui.views.of_recording.view import believable_floors


@dataclass(frozen=True)
class Board:
    """The error of all outputs together, by recording and time."""

    recordings: tuple[str, ...]
    edges: np.ndarray
    """(columns + 1,) s since the start"""
    ratio: np.ndarray
    """(recordings, columns) rms over the outputs, in floors"""


@dataclass(frozen=True)
class WhereItFails:
    """Of some comparisons."""

    comparisons: tuple[RecordingComparison, ...]
    stated: Mapping[str, float] | None
    """Floors that a diagnosis stands on."""
    floors: Mapping[str, float]
    maps: ErrorMaps
    board: Board | None
    now: Mapping[str, ErrorNow]
    """recording -> its error along the time"""


def where_it_fails(
    comparisons: tuple[RecordingComparison, ...], stated: Mapping[str, float] | None
) -> WhereItFails:
    """Maps, their board, and the error along the time."""
    from flexgui.core.diagnose.maps import error_maps

    floors = believable_floors(comparisons) if stated is None else stated
    maps = error_maps(comparisons, floors)
    traces = {c.recording: error_now(c, floors) for c in comparisons}
    known = {name: one for name, one in traces.items() if one is not None}
    return WhereItFails(comparisons, stated, floors, maps, _board(maps), known)


def _board(maps: ErrorMaps) -> Board | None:
    if not maps.by_time:
        return None
    first = max(maps.by_time, key=lambda m: len(m.recordings))
    layers = []
    for m in maps.by_time:
        layer = np.full(first.rms.shape, np.nan)
        for i, name in enumerate(m.recordings):
            if name in first.recordings and len(m.edges) == len(first.edges):
                layer[first.recordings.index(name)] = m.ratio[i]
        layers.append(layer)
    square = np.array(layers) ** 2
    known = np.isfinite(square)
    total = np.where(known, square, 0.0).sum(axis=0)
    many = known.sum(axis=0)
    ratio = np.where(many > 0, np.sqrt(total / np.maximum(many, 1)), np.nan)
    return Board(first.recordings, first.edges, ratio)
