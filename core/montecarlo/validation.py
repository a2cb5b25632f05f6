"""FIT on the validation sweeps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from core.resumable.journal import Record

LEVELS = {"lpv": "LPV", "rigid": "rigid arm", "nonlinear": "non-linear"}
"""level -> how it is called."""


@dataclass(frozen=True)
class Validation:
    """The sweeps of a study; fits[level] is (sweeps, 2) in %."""

    sweeps: tuple[int, ...]
    snr_db: float | None
    """Of the data that the estimates come from; the sweeps themselves have no noise."""
    fits: Mapping[str, np.ndarray]
    time: np.ndarray
    """s, of the first sweep's path."""
    theta2: np.ndarray
    """rad"""

    def mean(self, level: str) -> tuple[float, float]:
        """Average FIT of both velocities."""
        first, second = self.fits[level].mean(axis=0)
        return float(first), float(second)


def validation(records: Mapping[str, Record]) -> Validation | None:
    """None where no sweep is finished."""
    answers = [r["answer"] for key, r in sorted(records.items()) if r["part"] == "sweeps"]
    if not answers:
        return None
    return Validation(
        tuple(a["sweep"] for a in answers),
        answers[0]["snr_db"],
        {level: np.array([a["fit"][level] for a in answers]) for level in LEVELS},
        np.array(answers[0]["time"]),
        np.array(answers[0]["theta2"]),
    )
