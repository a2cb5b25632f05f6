"""What recordings tell about parameters: the deviations before and after an experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.diagnose.data import Hypothesis
from core.diagnose.next_experiment import RCOND
from core.identify.uncertainty import pseudo_inverse


@dataclass(frozen=True)
class Information:
    """Of a least-squares fit in noise floors whose channels have errors of other sizes.

    The estimate's covariance is A^-1 B A^-1 with A = sum S_c'S_c over the channels c and
    B = sum r_c^2 S_c'S_c, r_c the channel's error in floors (white).
    """

    labels: tuple[str, ...]
    A: np.ndarray
    B: np.ndarray

    def plus(self, other: Information) -> Information:
        """Of both together: labels that are the same are the same unknown."""
        labels = tuple(dict.fromkeys((*self.labels, *other.labels)))
        A, B = np.zeros((len(labels),) * 2), np.zeros((len(labels),) * 2)
        for one in (self, other):
            at = [labels.index(label) for label in one.labels]
            A[np.ix_(at, at)] += one.A
            B[np.ix_(at, at)] += one.B
        return Information(labels, A, B)

    def named(self, recording: str) -> Information:
        """The same experiment as another recording: its own unknowns are other ones."""
        labels = [f"{x.split('@')[0]}@{recording}" if "@" in x else x for x in self.labels]
        return Information(tuple(labels), self.A, self.B)

    def covariance(self, labels: Sequence[str]) -> np.ndarray:
        """(P, P) of these unknowns, SI; zero along a direction that nothing shows."""
        inverse = pseudo_inverse(self.A, RCOND)
        at = [self.labels.index(label) for label in labels]
        return np.asarray((inverse @ self.B @ inverse)[np.ix_(at, at)])


def information(h: Hypothesis, errors: Mapping[str, float]) -> Information:
    """Of the recordings that a fitted model stands on.

    Args:
        h: at its fitted vector.
        errors: channel -> rms error in noise floors.
    """
    labels = h.unknowns.labels
    A, B = np.zeros((len(labels),) * 2), np.zeros((len(labels),) * 2)
    pairs = zip(h.residuals.experiments, h.slopes(h.vector), strict=True)
    for experiment, S in pairs:
        for k, (channel, _) in enumerate(experiment.channels):
            rows = S[experiment.counted[:, k], k]
            gram = rows.T @ rows
            A += gram
            B += errors.get(channel, 1.0) ** 2 * gram
    return Information(tuple(labels), A, B)
