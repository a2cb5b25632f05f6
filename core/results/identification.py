"""What an identification found."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

RECORDING_MARK = "@"
"""Separates a parameter's name from its recording's."""


def labelled(name: str, recording: str | None) -> str:
    """A parameter's name, with the recording where it belongs to one: `mt2@th1`."""
    return name if recording is None else f"{name}{RECORDING_MARK}{recording}"


def values_in(recording: str, values: Mapping[str, float]) -> dict[str, float]:
    """Name -> value as one recording has them, of values by label."""
    parts = {label: label.partition(RECORDING_MARK) for label in values}
    return {n: values[k] for k, (n, mark, own) in parts.items() if not mark or own == recording}


@dataclass(frozen=True)
class Estimate:
    """One estimated parameter; `std` holds under coloured residuals."""

    name: str
    """As in a scenario: 'EI1', 'fc2', ..."""
    value: float
    """In `unit`, as are all numbers below."""
    std: float
    """Standard deviation; it holds only if the model is complete. NaN: not determined."""
    unit: str
    """SI; empty: none."""
    identifiable: bool
    """Whether the recordings determine it by itself; False: with others at best."""
    symbol: str = ""
    """LaTeX, for display."""
    start: float = np.nan
    """Where the fit began."""
    lower: float = -np.inf
    """Bound of the fit."""
    upper: float = np.inf
    """Bound of the fit."""
    recording: str | None = None
    """The recording that the parameter belongs to; None where it is shared by all."""
    at_bound: bool = False
    """Whether the fit ended at a bound."""
    title: str = ""
    """Its name in words."""

    @property
    def label(self) -> str:
        """Its name, with the recording where it belongs to one."""
        return labelled(self.name, self.recording)

    @property
    def undetermined(self) -> bool:
        """Whether only its bounds limit it: its standard deviation exceeds it, or the data leave it
        free and it ended at a bound."""
        wide = self.std > abs(self.value)
        free = not self.identifiable and (wide or self.at_bound)
        return bool(self.value) and bool(free or (wide and self.lower >= 0.0))


@dataclass(frozen=True)
class Valley:
    """Points along which the cost hardly changes, in the plane of two parameters."""

    names: tuple[str, str]
    units: tuple[str, str]
    points: np.ndarray
    """(k, 2), in `units`."""
    cost_ratio: np.ndarray
    """(k,), the cost there over the least cost."""
    direction: np.ndarray
    """(2,), relative changes of the two along it."""


@dataclass(frozen=True)
class Identifiability:
    """What the data fix and what they leave free."""

    names: tuple[str, ...]
    rank: int
    singular_values: np.ndarray
    """(p,), of the sensitivities to relative changes, weighted by the noise."""
    null_directions: np.ndarray
    """(p - rank, p), relative changes that the outputs do not show."""
    unsure: tuple[int, ...] = ()
    """Indices of those whose deviation exceeds their size."""
    valley: Valley | None = None


@dataclass(frozen=True)
class Generation:
    """One generation of the evolution, as streamed and as kept for the convergence plot."""

    number: int
    best: float
    mean: float
    worst: float
    best_vector: np.ndarray
    population: np.ndarray | None = None
    """(members, p) where it was asked for."""


@dataclass(frozen=True)
class Fit:
    """One minimisation: over all recordings (glocal) or over one (local)."""

    label: str
    recordings: tuple[str, ...]
    estimates: tuple[Estimate, ...]
    correlation: np.ndarray
    """(p, p)"""
    cost: float
    residual_count: int
    convergence: tuple[Generation, ...]
    identifiability: Identifiability
    gradient_norm: float
    """Norm of the scaled gradient relative to the cost's own scale; small means converged."""
    message: str = ""
    stopped: bool = False
    converged: bool | None = None
    """Whether the descent has ended at a minimum; None in a result of an older version."""
    derived: tuple[Estimate, ...] = ()
    """Quantities that follow from the estimates, such as EI from epsilon and d."""
    contradicted: Mapping[str, float] = field(default_factory=dict)
    """Label -> deviations by which the recordings alone differ from what was known a priori."""


@dataclass(frozen=True)
class Profile:
    """How much worse the best fit is with one parameter held beside its estimate."""

    estimate: Estimate
    level: float
    """Probability of `interval`."""
    threshold: float
    """Of the deviance, at the ends of `interval`."""
    values: np.ndarray
    """(K,) at which the parameter was held, rising, in the estimate's unit; the estimate is one"""
    deviance: np.ndarray
    """(K,) twice the loss of the logarithmic likelihood, no unit: (distance / std)^2 near the
    estimate"""
    others: tuple[str, ...]
    """Labels of the parameters that were fitted again, offsets and first states left out."""
    paths: np.ndarray
    """(K, others) their values"""

    @property
    def interval(self) -> tuple[float, float]:
        """Between which values the likelihood is not worse than the threshold; infinite towards a
        side where it never was."""
        k = int(np.argmin(np.abs(self.values - self.estimate.value)))
        return self._crossing(range(k, -1, -1), -np.inf), self._crossing(
            range(k, len(self.values)), np.inf
        )

    def _crossing(self, outwards: Iterable[int], without: float) -> float:
        """Where the deviance reaches the threshold; its root is nearly straight."""
        root, end = np.sqrt(np.maximum(self.deviance, 0.0)), np.sqrt(self.threshold)
        for a, b in pairwise(outwards):
            if root[b] >= end:
                share = (end - root[a]) / (root[b] - root[a])
                return float(self.values[a] + share * (self.values[b] - self.values[a]))
        return without


def final_values(fits: Sequence[Fit]) -> dict[str, float]:
    """label -> final value of the fits; the mean of shared ones."""
    by_label: dict[str, list[float]] = {}
    for e in (e for fit in fits for e in fit.estimates):
        by_label.setdefault(e.label, []).append(e.value)
    return {label: float(np.mean(values)) for label, values in by_label.items()}
