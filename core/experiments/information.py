"""What recordings tell about parameters: the deviations before and after an experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.diagnose.data import Hypothesis
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

    def deviations(self) -> dict[str, float]:
        """label -> standard deviation, SI; zero for a direction that nothing shows."""
        inverse = pseudo_inverse(self.A)
        covariance = inverse @ self.B @ inverse
        deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return dict(zip(self.labels, map(float, deviations), strict=True))


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


def narrowed(
    before: Mapping[str, float], model: Information, with_more: Information, names: Sequence[str]
) -> dict[str, float]:
    """name -> the deviation after more recordings, of the one that the fit stated before.

    The fit's own deviation knows that its errors are coloured; how much more recordings narrow it
    is taken from errors without colour, before and after alike.
    """
    was, will = model.deviations(), with_more.deviations()
    return {n: before[n] * will[n] / was[n] if was[n] > 0.0 else before[n] for n in names}
