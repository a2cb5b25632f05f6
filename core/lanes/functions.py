"""Elementary functions of wide numbers, by the names that generated code uses.

Sine, cosine and the exponential function are computed for all lanes at once, since every step of
an arm or of a Stribeck curve needs them; what only some force laws need is computed lane by lane.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..compiler import njit
from ..lanes.wide import (
    LANES,
    absolute,
    floor,
    get,
    lane,
    maximum,
    minimum,
    power_of_two,
    put,
    select,
    spread,
    with_lane,
)
from ..lanes.wide import sqrt as wide_sqrt

INLINE: dict[str, Any] = {
    "forceinline": True,
    "_nrt": False,
    "cache": True,
    "nogil": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
}
"""Of functions that compiled callers take in: to pass an array costs more than to add a few
numbers. They allocate nothing, so they count no references to arrays, which took longer than the
arithmetic. Python cannot call them: they compile sooner without the way in from there."""

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


LOG2_E = 1.4426950408889634
LN_2 = (6.93145751953125e-1, 1.42860682030941723212e-6)
EXP_P = (9.99999999999999999910e-1, 3.02994407707441961300e-2, 1.26177193074810590878e-4)
EXP_Q = (
    2.00000000000000000005, 2.27265548208155028766e-1, 2.52448340349684104192e-3,
    3.00198505138664455042e-6,
)  # fmt: skip
"""Of the Cephes library (Moshier 1989), exact to a unit in the last place."""
LARGEST_EXPONENT, LEAST_EXPONENT = 709.78, -708.39
"""Beyond these the exponential function is no normal double."""


@njit(**INLINE)
def exp(x):  # type: ignore[no-untyped-def]
    """Exponential function of each lane; 0 and infinity beyond the normal doubles."""
    x = spread(x)
    number = (x <= 0.0) | (x > 0.0)
    inside = minimum(maximum(x, LEAST_EXPONENT), LARGEST_EXPONENT)
    k = floor(inside * LOG2_E + 0.5)
    r = (inside - k * LN_2[0]) - k * LN_2[1]
    square = r * r
    p = r * (EXP_P[0] + square * (EXP_P[1] + square * EXP_P[2]))
    q = EXP_Q[0] + square * (EXP_Q[1] + square * (EXP_Q[2] + square * EXP_Q[3]))
    half = power_of_two(k - 1.0)  # k may be 1024, which is no exponent of a double
    value = 2.0 * ((1.0 + 2.0 * (p / (q - p))) * half)
    value = select(x > LARGEST_EXPONENT, np.inf, value)
    return select(number, select(x < LEAST_EXPONENT, 0.0, value), x)


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
log = _each_lane(math.log)
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
