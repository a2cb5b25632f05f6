"""Elementary functions of wide numbers, by the names that generated code uses.

Sine and cosine are computed for all lanes at once, since every step needs them; what only some
force laws need is computed lane by lane.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from numba import njit

from core.lanes.wide import (
    LANES,
    absolute,
    floor,
    get,
    lane,
    maximum,
    minimum,
    put,
    select,
    spread,
    with_lane,
)
from core.lanes.wide import sqrt as wide_sqrt

INLINE: dict[str, Any] = {
    "forceinline": True,
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
}

TWO_OVER_PI = 2.0 / math.pi
HALF_PI = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)
"""pi/2 in three parts of 33 bits: a multiple below 2^20 of the first two is exact (Cody and Waite,
Software Manual for the Elementary Functions, 1980). Angles of an arm stay far below that."""

SINE = (
    -1.66666666666666307295e-1, 8.33333333332211858878e-3, -1.98412698295895385996e-4,
    2.75573136213857245213e-6, -2.50507477628578072866e-8, 1.58962301576546568060e-10,
)  # fmt: skip
COSINE = (
    4.16666666666665929218e-2, -1.38888888888730564116e-3, 2.48015872888517045348e-5,
    -2.75573141792967388112e-7, 2.08757008419747316778e-9, -1.13585365213876817300e-11,
)  # fmt: skip
"""Coefficients of the Cephes library (Moshier 1989) on [-pi/4, pi/4], exact to a unit in the last
place."""


@njit(**INLINE)
def reduced(x):  # type: ignore[no-untyped-def]
    """(r, quarter): x = r + quarter pi/2 with |r| <= pi/4 and the quarter modulo 4 in 0..3."""
    k = floor(x * TWO_OVER_PI + 0.5)
    r = ((x - k * HALF_PI[0]) - k * HALF_PI[1]) - k * HALF_PI[2]
    return r, k - 4.0 * floor(k * 0.25)


@njit(**INLINE)
def sine_near_zero(r, square):  # type: ignore[no-untyped-def]
    """sin r for |r| <= pi/4."""
    p = SINE[4] + square * SINE[5]
    p = SINE[2] + square * (SINE[3] + square * p)
    p = SINE[0] + square * (SINE[1] + square * p)
    return r + r * square * p


@njit(**INLINE)
def cosine_near_zero(square):  # type: ignore[no-untyped-def]
    """cos r for |r| <= pi/4 from r^2."""
    p = COSINE[4] + square * COSINE[5]
    p = COSINE[2] + square * (COSINE[3] + square * p)
    p = COSINE[0] + square * (COSINE[1] + square * p)
    return 1.0 - 0.5 * square + square * square * p


@njit(**INLINE)
def sin(x):  # type: ignore[no-untyped-def]
    """Sine of each lane."""
    r, quarter = reduced(x)
    square = r * r
    odd = (quarter >= 0.5) & (quarter <= 1.5) | (quarter >= 2.5)
    value = select(odd, cosine_near_zero(square), sine_near_zero(r, square))
    return select(quarter >= 1.5, -value, value)


@njit(**INLINE)
def cos(x):  # type: ignore[no-untyped-def]
    """Cosine of each lane."""
    r, quarter = reduced(x)
    square = r * r
    odd = (quarter >= 0.5) & (quarter <= 1.5) | (quarter >= 2.5)
    value = select(odd, sine_near_zero(r, square), cosine_near_zero(square))
    return select((quarter >= 0.5) & (quarter <= 2.5), -value, value)


def _each_lane(function: Callable[[float], float]) -> Any:
    @njit(cache=True, nogil=True, error_model="numpy")
    def applied(x):  # type: ignore[no-untyped-def]
        out = spread(x)
        for i in range(LANES):
            out = with_lane(out, i, function(lane(out, i)))
        return out

    return applied


def _each_pair(function: Callable[[float, float], float]) -> Any:
    @njit(cache=True, nogil=True, error_model="numpy")
    def applied(x, y):  # type: ignore[no-untyped-def]
        out, other = spread(x), spread(y)
        for i in range(LANES):
            out = with_lane(out, i, function(lane(out, i), lane(other, i)))
        return out

    return applied


@njit
def _power(x, y):  # type: ignore[no-untyped-def]
    return x**y


tan, asin, acos, atan = (_each_lane(f) for f in (math.tan, math.asin, math.acos, math.atan))
sinh, cosh, tanh = (_each_lane(f) for f in (math.sinh, math.cosh, math.tanh))
exp, log = _each_lane(math.exp), _each_lane(math.log)
atan2, power = _each_pair(math.atan2), _each_pair(_power)


@njit(**INLINE)
def sqrt(x):  # type: ignore[no-untyped-def]
    """Root of each lane."""
    return wide_sqrt(x)


@njit(**INLINE)
def sign(x):  # type: ignore[no-untyped-def]
    """-1, 0 or 1 of each lane."""
    x = spread(x)
    return select(x > 0.0, 1.0, 0.0) - select(x < 0.0, 1.0, 0.0)


@njit(**INLINE)
def step(x):  # type: ignore[no-untyped-def]
    """1 where x is positive, else 0."""
    return select(spread(x) > 0.0, 1.0, 0.0)


__all__ = [
    "absolute", "acos", "asin", "atan", "atan2", "cos", "cosh", "exp", "get", "log", "maximum",
    "minimum", "power", "put", "select", "sign", "sin", "sinh", "spread", "sqrt", "step", "tan",
    "tanh",
]  # fmt: skip
