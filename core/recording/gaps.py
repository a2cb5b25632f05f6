"""Empty cells in columns that need a number in every row: bridged, left out, or cut off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def runs(empty: np.ndarray) -> list[tuple[int, int]]:
    """(first, stop) of each run of True in a mask (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], empty.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def too_long(empty: np.ndarray, most: int) -> int | None:
    """The first row of a run longer than `most` rows, or of one at an end, where nothing lies
    beyond to bridge to; None where there is none."""
    for first, stop in runs(empty):
        if stop - first > most or first == 0 or stop == len(empty):
            return first
    return None


def bridged(values: np.ndarray, empty: np.ndarray) -> np.ndarray:
    """(N,) with straight lines over the empty rows, which are even in time."""
    at = np.arange(len(values))
    return np.where(empty, np.interp(at, at[~empty], values[~empty]), values)


def longest_complete(empties: Sequence[np.ndarray], N: int) -> slice:
    """The longest stretch of rows, of N, in which none of the masks (N,) is True."""
    complete = ~np.any(np.vstack([np.zeros((1, N), dtype=bool), *empties]), axis=0)
    stretches = runs(complete)
    first, stop = max(stretches, key=lambda pair: pair[1] - pair[0], default=(0, 0))
    return slice(first, stop)
