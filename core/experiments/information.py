"""Information of recordings about parameters: standard deviations before and after an
experiment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..estimate.problem import Problem
from ..identify.defect_correction import MOST_STEPS, with_steps
from ..identify.uncertainty import Autocovariance, score_covariance
from ..least_squares import SEEN, pseudo_inverse


@dataclass(frozen=True)
class Information:
    """Of a least-squares fit under coloured errors (core.identify.uncertainty).

    The estimate's covariance is A^-1 B A^-1 with A = sum S'S and B = sum S' cov(r) S.
    """

    labels: tuple[str, ...]
    A: np.ndarray
    B: np.ndarray

    def plus(self, other: Information) -> Information:
        """Information of both; equal labels are the same unknown."""
        labels = tuple(dict.fromkeys((*self.labels, *other.labels)))
        A, B = np.zeros((len(labels),) * 2), np.zeros((len(labels),) * 2)
        for part in (self, other):
            at = [labels.index(label) for label in part.labels]
            A[np.ix_(at, at)] += part.A
            B[np.ix_(at, at)] += part.B
        return Information(labels, A, B)

    def named(self, recording: str) -> Information:
        """The same experiment as another recording, with its own unknowns."""
        labels = [f"{x.split('@')[0]}@{recording}" if "@" in x else x for x in self.labels]
        return Information(tuple(labels), self.A, self.B)

    def covariance(self, labels: Sequence[str]) -> np.ndarray:
        """(P, P) of these unknowns, SI; zero along undetermined directions."""
        inverse = pseudo_inverse(self.A, SEEN)
        at = [self.labels.index(label) for label in labels]
        return np.asarray((inverse @ self.B @ inverse)[np.ix_(at, at)])


def information(
    labels: Sequence[str], slopes: Sequence[np.ndarray], errors: Sequence[Autocovariance]
) -> Information:
    """Of recordings with slopes (M, k, P), weighted, zero where a sample does not count, of the
    unknowns with these labels, and the autocovariance of each recording's errors."""
    A, B = np.zeros((len(labels),) * 2), np.zeros((len(labels),) * 2)
    for S, covariances in zip(slopes, errors, strict=True):
        flat = S.reshape(-1, len(labels))
        A += flat.T @ flat
        B += score_covariance(S, covariances)
    return Information(tuple(labels), A, B)


def expected(problem: Problem, errors: Autocovariance, within: float = np.inf) -> Information:
    """Of an experiment to come: the fitted model on it, with the errors of the recordings there
    are. More steps may change what it shows of any unknown by a share `within`: a vibration that
    few steps damp shows little."""
    steps = problem.substeps
    shown = _with_steps(problem, errors, steps)
    while np.isfinite(within) and steps < MOST_STEPS:
        steps, coarse = 2 * steps, shown
        shown = _with_steps(problem, errors, steps)
        changed = np.abs(np.diag(shown.A) - np.diag(coarse.A))
        if np.all(changed <= within * np.diag(shown.A)):
            break
    return shown


def _with_steps(problem: Problem, errors: Autocovariance, steps: int) -> Information:
    slopes = with_steps(problem.residuals, steps).slopes(problem.vector, central=False)
    return information(problem.unknowns.labels, slopes, [errors] * len(slopes))
