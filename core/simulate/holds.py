"""Pieces of an experiment over which its references are held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LONGEST = 32
"""Samples of a piece at most: beyond it the outputs' rows leave the first-level cache."""


@dataclass(frozen=True)
class Pieces:
    """Consecutive pieces that cover all samples."""

    table: np.ndarray
    """(3, B): first samples, numbers of samples, and the numbers' places among `lengths`"""
    lengths: np.ndarray
    """The distinct numbers, ascending."""

    @property
    def count(self) -> int:
        """B"""
        return int(self.table.shape[1])


def changes(references: Sequence[np.ndarray], samples: int) -> np.ndarray:
    """Samples after the first at which some experiment's references (N_i, nr) change."""
    found: set[int] = set()
    for each in references:
        found.update((np.flatnonzero(np.any(each[1:] != each[:-1], axis=1)) + 1).tolist())
    return np.array(sorted(k for k in found if k < samples), dtype=np.int64)


def cut(edges: np.ndarray, samples: int, longest: int) -> Pieces:
    """The stretches between the edges, each in pieces of `longest` samples and a rest."""
    bounds = np.concatenate([[0], edges, [samples]])
    starts = np.concatenate(
        [np.arange(a, b, longest) for a, b in zip(bounds[:-1], bounds[1:], strict=True)]
    ).astype(np.int64)
    counts = np.diff(np.append(starts, samples)).astype(np.int64)
    lengths, which = np.unique(counts, return_inverse=True)
    return Pieces(np.stack([starts, counts, which.ravel()]).astype(np.int64), lengths)


def pieces(
    references: Sequence[np.ndarray], samples: int, states: int, inputs: int, outputs: int,
    longest: int = LONGEST,
) -> Pieces:  # fmt: skip
    """The pieces of least work for a system with that many states, held inputs and outputs."""
    edges = changes(references, samples)
    columns = states + inputs

    def work(length: int) -> int:
        """Multiply-adds that depend on the longest piece."""
        found = cut(edges, samples, length)
        powers = len(found.lengths) + int(np.ceil(np.log2(length + 1)))
        per_build = powers * columns**3 + length * outputs * columns**2
        return per_build + found.count * states * columns

    runs = np.diff(np.concatenate([[0], edges, [samples]]))
    tried = sorted({min(int(run), longest) for run in np.unique(runs)} | {1})
    return cut(edges, samples, min(tried, key=work))
