"""The zero-phase low-pass of many complete signals at once.

A fit filters what the model says some ten thousand times. `scipy.signal.sosfiltfilt` computes the
states of a constant input each time and goes through the signals one by one; here they stand side
by side, and the interpreter is free for others. The same numbers to the last digits.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from core.arm.signatures import OPTIONS, kernel, matrix
from core.recording.velocity import ZeroPhaseLowPass


def filtered(
    low_pass: ZeroPhaseLowPass, x: np.ndarray, dt: float, even: bool = False
) -> np.ndarray:
    """`low_pass.apply` along the first axis of signals without empty samples.

    Args:
        low_pass: Its order and cut-off.
        x: (N, ...), without NaN.
        dt: s
        even: whether the ends are mirrored as they are, not in their last sample: the noise of a
            second difference there would go on beyond it.

    Returns:
        (N, ...); NaN where N is too short for the filter.

    Raises:
        InputError: The cut-off is not below half the sampling rate.
    """
    if len(x) < low_pass.shortest:
        return np.full(x.shape, np.nan)
    sections, steady = low_pass.design(dt)
    flat = np.ascontiguousarray(x.reshape(len(x), -1))
    padding = low_pass.padding(len(x), dt)
    return _both_ways(sections, steady, flat, padding, 0.0 if even else 2.0).reshape(x.shape)


@njit(**OPTIONS)
def _through(sections, steady, x, back):  # type: ignore[no-untyped-def]
    """x (N, k) in place through sections (s, 6) that have settled at the row they begin with."""
    N, k = x.shape
    first = x[N - 1 if back else 0].copy()
    low, high = np.empty(k), np.empty(k)
    for s in range(len(sections)):
        b0, b1, b2 = sections[s, 0], sections[s, 1], sections[s, 2]
        a1, a2 = sections[s, 4], sections[s, 5]
        for c in range(k):
            low[c], high[c] = steady[s, 0] * first[c], steady[s, 1] * first[c]
        for m in range(N):
            n = N - 1 - m if back else m
            for c in range(k):
                u = x[n, c]
                y = b0 * u + low[c]
                low[c] = b1 * u - a1 * y + high[c]
                high[c] = b2 * u - a2 * y
                x[n, c] = y


@kernel(matrix(matrix, matrix, matrix, types.int64, types.float64))
def _both_ways(sections, steady, x, padding, around):  # type: ignore[no-untyped-def]
    """(N, k) of x (N, k), whose ends are extended by as many samples, mirrored `around` / 2 times
    the last one and, where it is zero, upright."""
    sign = -1.0 if around else 1.0
    N, k = x.shape
    y = np.empty((N + 2 * padding, k))
    for n in range(padding):
        for c in range(k):
            y[n, c] = around * x[0, c] + sign * x[padding - n, c]
            y[padding + N + n, c] = around * x[N - 1, c] + sign * x[N - 2 - n, c]
    y[padding : padding + N] = x
    _through(sections, steady, y, False)
    _through(sections, steady, y, True)
    return y[padding : padding + N].copy()
