"""Where the model fails, worked out once for all who look at a session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.diagnose.maps import error_maps, noise_floors
from core.results import ErrorMaps, RecordingComparison
from flexgui.views.error_now import ErrorNow, error_now


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
    floors = believable(comparisons) if stated is None else stated
    maps = error_maps(comparisons, floors)
    traces = {c.recording: error_now(c, floors) for c in comparisons}
    known = {name: one for name, one in traces.items() if one is not None}
    return WhereItFails(comparisons, stated, floors, maps, _board(maps), known)


def believable(comparisons: Sequence[RecordingComparison]) -> dict[str, float]:
    """Floors where no diagnosis has stated any: of what was fitted and of the encoders; what is
    computed from other channels has no noise of its own. As in a diagnosis no model is asked for
    the last thousandth of what a channel does."""
    from core.diagnose.diagnose import FIDELITY  # late: it loads all of a diagnosis

    spread: dict[str, list[float]] = {}
    for r in comparisons:
        for c in r.channels:
            if c.counted.any() and (c.fitted or c.channel.startswith("theta")):
                spread.setdefault(c.channel, []).append(float(np.std(c.measured[c.counted])))
    noise = noise_floors(comparisons)
    floors = {
        name: float(np.hypot(noise.get(name, 0.0), FIDELITY * np.median(sizes)))
        for name, sizes in spread.items()
    }
    return {name: floor for name, floor in floors.items() if floor > 0.0}


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
