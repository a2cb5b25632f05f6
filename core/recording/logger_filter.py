"""The low-pass that a rig's logger applied, run on a model's output."""

from __future__ import annotations

import numpy as np
from scipy import signal

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
    w, zeta = logger_filter.frequency, logger_filter.damping
    continuous = ([w * w], [1.0, 2.0 * zeta * w, w * w])
    # x - x[0] starts at zero, where the ramp-invariant recursion at rest has no transient ...
    b, a, _ = signal.cont2discrete(continuous, dt, method="foh")
    moved = signal.lfilter(np.ravel(b), a, x - x[0], axis=0)
    if steady:
        return np.asarray(x[0] + moved)
    # ... and the constant x[0] meets the empty filter as a step, exact with a zero-order hold.
    b, a, _ = signal.cont2discrete(continuous, dt, method="zoh")
    step = signal.lfilter(np.ravel(b), a, np.ones(len(x)))
    return np.asarray(moved + np.multiply.outer(step, x[0]))
