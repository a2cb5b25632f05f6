"""Our tables beside the paper's: what agrees, and what its own numbers imply."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.montecarlo.estimates import EstimateTable
from core.montecarlo.printed import WORKING_POINTS, Numbers, printed, stiffness

SAME_POINT = 1e-3
"""rad: working points that are the paper's to the digits that a scenario gives."""

GIGA, MILLI = 1e-9, 1e3


@dataclass(frozen=True)
class Agreement:
    """One mean of ours beside the paper's."""

    snr_db: float | None
    label: str
    name: str
    ours: float
    paper: float
    deviation: float
    """The paper's; ours and the paper's in GPa or mm."""

    @property
    def within(self) -> bool:
        """Whether the two agree within one deviation."""
        return abs(self.ours - self.paper) <= self.deviation


def comparable(table: EstimateTable) -> tuple[Numbers, ...] | None:
    """The paper's table where ours has its experiments and parameters."""
    told = printed(table.snr_db)
    points = [row.theta2 or 0.0 for row in table.locals]
    if told is None or len(points) != len(WORKING_POINTS):
        return None
    near = np.allclose(points, WORKING_POINTS, rtol=0.0, atol=SAME_POINT)
    known = {"epsilon", "d"} == set(table.rows[0].values)
    return told if near and known else None


def agreements(tables: Sequence[EstimateTable]) -> tuple[Agreement, ...]:
    """Every mean of ε and d that the paper prints."""
    found = []
    for table in tables:
        for row, numbers in zip(table.rows, comparable(table) or (), strict=False):
            for name, factor, at in (("epsilon", GIGA, 0), ("d", MILLI, 2)):
                ours = row.values[name].mean * factor
                found.append(
                    Agreement(table.snr_db, row.label, name, ours, numbers[at], numbers[at + 1])
                )
    return tuple(found)


def implied_bias(numbers: Numbers, EI: float) -> float:
    """Relative, of the EI that printed means imply."""
    return stiffness(numbers[0], numbers[2]) / EI - 1.0


def least_scatter(numbers: Numbers) -> float:
    """Relative: EI = ε d⁴ / 12 scatters at least by |4 std(d)/d - std(ε)/ε|, which is zero where
    all runs lie on one valley."""
    epsilon, epsilon_std, d, d_std = numbers
    return abs(4.0 * d_std / d - epsilon_std / epsilon)
