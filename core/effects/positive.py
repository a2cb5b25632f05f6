"""Parameters that must stay above zero: times, compliances, limits."""

from __future__ import annotations

from collections.abc import Sequence

from core.effects.effect import EffectParameter
from core.parameters import Parameter


def positive(
    name: str,
    start: float,
    unit: str,
    title: str,
    symbol: str,
    *,
    lower: float,
    upper: float,
    neutral: float = 0.0,
    grid: Sequence[float] = (),
    secondary: bool = False,
    finely: Sequence[float] = (),
) -> EffectParameter:
    """A parameter with both bounds stated; the neutral value may lie outside them."""
    parameter = Parameter(name, start, unit, lower, upper, symbol, title, scale=start)
    return EffectParameter(parameter, neutral, tuple(grid), secondary, tuple(finely))
