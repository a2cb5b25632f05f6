"""The size at which something first shows as much as was asked for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

CLOSE = 0.02
"""Relative accuracy of what is shown: far below what the interval of a size is."""

SCAN = 2.0
"""Factor from one size to the next while a crossing is sought."""

MOST_SCANS, MOST_STEPS = 40, 30


def crossing(shown: Callable[[float], float], level: float) -> tuple[float, float]:
    """The multiplier at which `shown` first reaches `level`, coming from neutral, and its value.

    Scans in octaves, then halves the interval by the rule of false position in logarithms (the
    Illinois variant), since most effects are straight lines there.
    """
    low, high, f_low, f_high = _bracket(shown, level)
    for _ in range(MOST_STEPS):
        if high / low < 1.0 + 1e-9:
            break
        share = -f_low / (f_high - f_low)
        m = float(low * (high / low) ** np.clip(share, 0.1, 0.9))
        f = _gap(shown(m), level)
        if abs(f) < np.log1p(CLOSE):
            return m, float(level * np.exp(f))
        if f < 0.0:
            low, f_low = m, f
        else:
            high, f_high = m, f
    return high, float(level * np.exp(f_high))


LEAST = 1e-3
"""Share of the level below which an effect counts as not seen at all."""


def _gap(found: float, level: float) -> float:
    """log(found / level), bounded where nothing is seen; a motion that went astray is too large."""
    if not np.isfinite(found):
        return float(-np.log(LEAST))
    return float(np.log(max(found / level, LEAST)))


def _bracket(shown: Callable[[float], float], level: float) -> tuple[float, float, float, float]:
    m, f = 1.0, _gap(shown(1.0), level)
    if f < 0.0:
        for _ in range(MOST_SCANS):
            low, f_low = m, f
            m *= SCAN
            f = _gap(shown(m), level)
            if f >= 0.0:
                return low, m, f_low, f
    else:
        for _ in range(MOST_SCANS):
            high, f_high = m, f
            m /= max(SCAN, min(np.exp(f), 64.0))
            f = _gap(shown(m), level)
            if f < 0.0:
                return m, high, f, f_high
    raise UnreachableError(
        f"no size of the effect shows {level:g} times the noise (last {m:g}: {f:g})"
    )


class UnreachableError(ValueError):
    """No size of an effect shows what was asked for."""
