"""A slide in free run, and its parameters from the errors of free runs over windows.

m q'' = u - fv q' - fa |q'| - fc sign(q'), with the force straight between samples: the structure
that the diagnosis finds on EMPS. Heun's rule at the samples; a turn-round ends the step at rest.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.optimize import least_squares

from tests.programs.evidence.emps_rules import FIRST, MOTION_HZ, Table, _rate, _smooth

NAMES = ("m1", "fv1", "fc1", "fa1")
SCALES = np.array([100.0, 200.0, 20.0, 40.0])
"""kg, N s/m, N, N s/m: the sizes of a slide like this one."""
STEP = 1e-4
"""Relative, of differences: the errors are smooth in the parameters."""
SEARCHES = 15
THINNED = 5
"""Every fifth sample of an error, which is slow, is fitted."""
MM = 1e3


@njit
def _moved(  # type: ignore[no-untyped-def]
    values: np.ndarray, force: np.ndarray, q: float, v: float, step: float
):
    m, fv, fc, fa = values
    found = np.empty(len(force))
    for i in range(len(force)):
        found[i] = q
        u = 0.5 * (force[i] + force[min(i + 1, len(force) - 1)])
        way = np.sign(v) if v != 0.0 else np.sign(u)
        first = (u - fv * v - fa * abs(v) - fc * way) / m
        there = v + step * first
        second = (u - fv * there - fa * abs(there) - fc * way) / m
        new = v + 0.5 * step * (first + second)
        if (v == 0.0 and abs(u) <= fc) or new * way < 0.0:
            new = 0.0
        q, v = q + 0.5 * step * (v + new), new
    return found


def free_error(values: np.ndarray, data: Table, first: int, last: int) -> np.ndarray:
    """(last - first,) in mm: measured minus run freely from a line through the samples before."""
    at = slice(first - FIRST, first)
    speed, place = np.polyfit(data.time[at] - data.time[first], data.q[at], 1)
    run = _moved(values, data.force[first:last], place, speed, data.step)
    return MM * (data.q[first:last] - run)


def window_errors(
    values: np.ndarray, data: Table, window: int, first: int, last: int
) -> np.ndarray:
    """In mm, of runs of `window` samples one after the other, each from the measured state."""
    smooth = _smooth(data.q, data.step, MOTION_HZ)
    rates = _rate(smooth, data.step)
    found = []
    for a in range(first, last, window):
        b = min(a + window, last)
        run = _moved(values, data.force[a:b], smooth[a], rates[a], data.step)
        found.append(MM * (data.q[a:b] - run))
    return np.concatenate(found)


def fitted_over(data: Table, window: int, start: np.ndarray, first: int, last: int) -> np.ndarray:
    """Values (4,) by NAMES with the least errors over windows of that many samples."""

    def errors(scaled: np.ndarray) -> np.ndarray:
        return window_errors(scaled * SCALES, data, window, first, last)[::THINNED]

    found = least_squares(errors, start / SCALES, diff_step=STEP, max_nfev=SEARCHES)
    return np.asarray(found.x * SCALES)
