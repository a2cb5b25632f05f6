"""Physical parameters and the vector that an optimiser sees."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .errors import InputError

AT_BOUND = 1e-6
"""Of a typical size: nearer than this a parameter is at its bound."""


@dataclass(frozen=True)
class Parameter:
    """One physical number with what is needed to show it, bound it and vary it.

    `scale` is a typical size: steps, bounds and conditioning are relative to it, so a parameter
    that starts at zero (an offset, a damping) can still be varied.
    """

    name: str
    """As in a scenario: 'EI1', 'fc2', ..."""
    value: float
    """In `unit`, as are all numbers below."""
    unit: str = ""
    """SI; empty: none."""
    lower: float = -np.inf
    """The least value that a fit may give it."""
    upper: float = np.inf
    """The greatest value that a fit may give it."""
    symbol: str = ""
    """LaTeX, for display."""
    title: str = ""
    """Its name in words."""
    scale: float = 1.0
    """A typical size."""
    prior_std: float | None = None
    """Standard deviation of what is known before the fit; None: nothing is."""
    prior_mean: float | None = None
    """What the prior is about; the value where it is not stated."""

    def __post_init__(self) -> None:
        if not np.isfinite(self.value):
            raise InputError(f"Parameter {self.name} has the value {self.value}; give a number.")
        if not self.lower <= self.value <= self.upper:
            raise InputError(
                f"Parameter {self.name} starts at {self.value:g}, outside its bounds "
                f"[{self.lower:g}, {self.upper:g}]; move the start or the bounds."
            )

    @property
    def positive(self) -> bool:
        """Whether the sign is fixed, so that relative changes make sense."""
        return self.lower > 0.0

    def at_bound(self, value: float) -> bool:
        """Whether a value in its unit is at a bound, to a millionth of a typical size."""
        margin = AT_BOUND * self.scale
        return not self.lower + margin < value < self.upper - margin


@dataclass(frozen=True)
class ParameterSet:
    """An ordered set of parameters and its translation to and from a vector (p,)."""

    items: tuple[Parameter, ...]

    def __post_init__(self) -> None:
        names = [item.name for item in self.items]
        doubled = sorted({name for name in names if names.count(name) > 1})
        if doubled:
            raise InputError(f"Parameter {doubled[0]} is listed twice; list it once.")

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self.items)

    def vector(self) -> np.ndarray:
        """(n,) values, each in its unit."""
        return np.array([item.value for item in self.items], dtype=float)

    def lower(self) -> np.ndarray:
        """(n,) lower bounds, each in its unit."""
        return np.array([item.lower for item in self.items], dtype=float)

    def upper(self) -> np.ndarray:
        """(n,) upper bounds, each in its unit."""
        return np.array([item.upper for item in self.items], dtype=float)

    def scales(self) -> np.ndarray:
        """(n,) typical sizes, each in its unit."""
        return np.array([item.scale for item in self.items], dtype=float)
