"""The low-pass that a rig's logger applied, run on a model's output."""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy

from core.recording.recording import LoggerFilter


def apply_logger_filter(
    x: np.ndarray, dt: float, logger_filter: LoggerFilter, *, steady: bool = True
) -> np.ndarray:
    """x (N, ...) along its first axis through w^2 / (s^2 + 2 zeta w s + w^2), exact for input
    that is linear in between.

    `steady` starts with the filter settled at the first sample, otherwise it starts empty.
    """
    x = np.asarray(x, dtype=float)
    if not np.isfinite(x).all():
        raise ValueError("a logger's filter runs on complete signals; the signal has empty samples")
    # x - x[0] starts at zero, where the ramp-invariant recursion at rest has no transient ...
    b, a = _recursion(logger_filter, dt, "foh")
    moved = scipy.signal.lfilter(b, a, x - x[0], axis=0)
    if steady:
        return np.asarray(x[0] + moved)
    # ... and the constant x[0] meets the empty filter as a step, exact with a zero-order hold.
    b, a = _recursion(logger_filter, dt, "zoh")
    step = scipy.signal.lfilter(b, a, np.ones(len(x)))
    return np.asarray(moved + np.multiply.outer(step, x[0]))


@cache
def _recursion(
    logger_filter: LoggerFilter, dt: float, method: str
) -> tuple[np.ndarray, np.ndarray]:
    """b and a of the discretised filter; made once, as making them takes longer than the filter."""
    w, zeta = logger_filter.frequency, logger_filter.damping
    b, a, _ = scipy.signal.cont2discrete(([w * w], [1.0, 2.0 * zeta * w, w * w]), dt, method=method)
    return np.ravel(b), a
