"""Where a bias in EI can come from, over many draws of the excitation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from core.resumable.journal import Record


@dataclass(frozen=True)
class BiasSource:
    """Relative bias of EI without noise, for one excitation and one way to take J."""

    excitation: str
    rates: str
    """'tip', 'encoders' or 'working point': at which angles J is taken."""
    local: np.ndarray
    """(draws, points)"""
    glocal: np.ndarray
    """(draws,)"""
    wander: np.ndarray
    """(draws, points) rad: the range of theta2 in each experiment."""

    @property
    def rms(self) -> np.ndarray:
        """(points,)"""
        return np.sqrt(np.mean(self.local**2, axis=0))

    @property
    def glocal_rms(self) -> float:
        """Root mean square of the glocal estimates' bias."""
        return float(np.sqrt(np.mean(self.glocal**2)))


def bias_sources(records: Mapping[str, Record]) -> tuple[BiasSource, ...]:
    """In the order in which they were computed; empty where none is finished."""
    answers = [r["answer"] for key, r in sorted(records.items()) if r["part"] == "bias"]
    if not answers:
        return ()
    found = []
    for k, first in enumerate(answers[0]["sources"]):
        each = [a["sources"][k] for a in answers]
        found.append(
            BiasSource(
                first["excitation"],
                first["rates"],
                np.array([s["local"] for s in each]),
                np.array([s["glocal"] for s in each]),
                np.array([s["wander"] for s in each]),
            )
        )
    return tuple(found)
