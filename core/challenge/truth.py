"""What a challenge hides; the page reads it without what simulates one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

LEVELS: Mapping[str, tuple[int, float, float]] = {"easy": (1, 3.0, 10.0), "hard": (2, 2.0, 4.0)}
"""level -> number of hidden effects, and their least and largest size in noise rms per sample."""


@dataclass(frozen=True)
class Truth:
    """What is hidden in the recordings of a challenge."""

    shown: dict[str, float]
    """Id of an effect -> its size in noise rms per sample, after a refit of the nominal
    parameters."""
    values: dict[str, float]
    """Parameter of an effect -> its size, in SI units."""
    EI: float
    """N m², of both beams."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Ids of what is hidden."""
        return tuple(self.shown)
