"""Units that suit the size of a number: a deflection reads in mm, a modulus in GPa."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LARGER = {"Pa": ((1e8, 1e-9, "GPa"), (1e5, 1e-6, "MPa")), "N": ((1e4, 1e-3, "kN"),)}
"""Unit -> (from this size on, factor, shown unit)."""

SMALLER = {
    "m": (0.2, 1e3, "mm"),
    "m/s": (0.02, 1e3, "mm/s"),
    "rad": (0.02, 1e3, "mrad"),
    "rad/s": (0.02, 1e3, "mrad/s"),
    "N m": (0.02, 1e3, "mN m"),
    "s": (0.2, 1e3, "ms"),
}
"""Unit -> (below this size, factor, shown unit)."""


@dataclass(frozen=True)
class ShownUnit:
    """A number in the unit of the results times `factor` is the number in `name`."""

    factor: float
    name: str

    def label(self, what: str) -> str:
        """An axis title such as 'θ1 [mrad]'."""
        return f"{what} [{self.name or '–'}]"


def shown_unit(values: float | np.ndarray, unit: str) -> ShownUnit:
    """The unit to show `values` in, by their largest finite size."""
    sizes = np.abs(np.atleast_1d(np.asarray(values, dtype=float)))
    sizes = sizes[np.isfinite(sizes)]
    largest = float(sizes.max()) if sizes.size else 0.0
    for limit, factor, name in LARGER.get(unit, ()):
        if largest >= limit:
            return ShownUnit(factor, name)
    limit, factor, name = SMALLER.get(unit, (0.0, 1.0, unit))
    if 0.0 < largest < limit:
        return ShownUnit(factor, name)
    return ShownUnit(1.0, unit)
