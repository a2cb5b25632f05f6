"""One parameter over several runs of the same experiment."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Disagreement:
    """A run whose parameter is not what the other runs say."""

    run: str
    share: float
    """Of the others' mean by which it differs."""
    p_value: float


@dataclass(frozen=True)
class Repeated:
    """One parameter over the runs of an experiment."""

    name: str
    unit: str
    mean: float
    between: float
    """Standard deviation between runs, those left out that disagree; what a next run will do."""
    within: float
    """Root mean square of the runs' own deviations."""
    interval: tuple[float, float]
    """95 %, of the mean; Student's, since few runs tell the scatter between them."""
    disagreeing: tuple[Disagreement, ...]
