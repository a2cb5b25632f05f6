"""Steps, jumps, limits, outliers and noise of one signal, by its values alone."""

from __future__ import annotations

import numpy as np
import scipy

from ..noise.sensor_noise import common_quantisation_step, noise_of


def lattice_step(x: np.ndarray) -> float:
    """Quantisation step of values x (N,), in their unit, with many samples per level; 0: none."""
    values = x[np.isfinite(x)]
    return 0.0 if len(np.unique(values)) > len(values) / 5 else common_quantisation_step([values])


SHARE_AT_LIMIT = 0.01
"""Share of the samples; real recordings have 0.2 % at their largest value."""
FEWEST_AT_LIMIT = 8
"""Fewest samples at a limit."""
LONGEST_CONSTANT_RUN = 20
"""Equal samples in a row: noise and motion never repeat a value so often."""
FAR = 8.0
"""Times what nearly all samples stand out by at most; white noise stays below four."""


def jumps(x: np.ndarray) -> list[tuple[int, float]]:
    """Samples from which on a position x (N,) is shifted, and by how much: it moves there FAR
    beyond what it does around. It does not come back as an outlier does, nor does it leave a
    frozen stretch or a zero."""
    moves = np.diff(x)
    steps = np.abs(moves)
    if not steps.any():
        return []
    usual = max(np.percentile(steps, 99), np.median(steps[steps > 0]))
    found = []
    for k in np.flatnonzero(steps > FAR * usual):
        around = slice(max(k - 2, 0), k + 3)
        alone = np.sum(steps[around] > steps[k] / FAR) == 1
        if alone and steps[max(k - LONGEST_CONSTANT_RUN, 0) : k].any() and x[k] * x[k + 1] != 0.0:
            found.append((int(k) + 1, float(moves[k] - np.median(moves[around]))))
    return found


def breaks_off(x: np.ndarray, first: int, after: int) -> bool:
    """Whether a signal x (N,) that repeats a value from sample `first` to the one before `after`
    stops or goes on within a sample, faster than inertia lets it change its speed elsewhere. What
    comes to rest and leaves it does not, nor does what was and stays at rest."""
    changes, moves = np.abs(np.diff(x, 2)), np.abs(np.diff(x))
    elsewhere = np.r_[changes[: max(first - 2, 0)], changes[after:]]
    elsewhere = elsewhere if elsewhere.any() else changes
    usual = max(np.percentile(elsewhere, 99), np.median(elsewhere[elsewhere > 0.0]))
    edges = [moves[k - 1] for k in (first, after) if 0 < k < len(x)]
    return bool(max(edges, default=0.0) > 1.5 * usual)  # a count more or less is none


NEAR_LIMIT = 0.02
"""Share of the range: a smooth turning point has more samples below its top than at it."""
FAST = 0.25
"""Share of the usual speed: a signal runs into a limit, an encoder at rest does not."""


def limit_of(values: np.ndarray) -> tuple[float, float] | None:
    """(the value at which a signal of `values` (N,) is cut off, share of its samples there), or
    None."""
    x = values[np.isfinite(values)]
    if len(x) < 5 * FEWEST_AT_LIMIT or np.ptp(x) == 0.0:
        return None
    limits = [each for each in (_at(x, x.max(), 1.0), _at(x, x.min(), -1.0)) if each is not None]
    return max(limits, key=lambda limit: limit[1]) if limits else None


def _at(x: np.ndarray, top: float, side: float) -> tuple[float, float] | None:
    at = x == top
    count = int(at.sum())
    levels = np.unique(x)
    step = float(np.median(np.diff(levels)))
    below = side * (top - x)
    near = int(np.sum((below > 0) & (below <= max(NEAR_LIMIT * float(np.ptp(x)), 3.0 * step))))
    if count < max(FEWEST_AT_LIMIT, SHARE_AT_LIMIT * len(x)) or count <= near:
        return None
    edges = np.flatnonzero(np.diff(at.astype(int)) != 0)
    if len(edges) == 0 or not np.any(at[1:] & at[:-1]):
        return None
    if lattice_step(x) > 0 and len(edges) <= 2:
        return None  # where dry friction holds a joint once, an encoder repeats a value as well
    speed = np.abs(np.diff(x))
    usual = float(np.sqrt(np.mean(speed**2)))
    # Two samples before the limit and two after it.
    speeds = [speed[np.clip([k - 1, k, k + 1], 0, len(speed) - 1)].max() for k in edges]
    return (float(top), count / len(x)) if np.median(speeds) > FAST * usual else None


OF_SPREAD = 0.5
"""Of the channel's standard deviation: in recordings of real drives, currents stand out by 0.3."""
MOST_OUTLIERS = 0.03
"""Of the samples; more are no outliers."""


def far_out(x: np.ndarray, share: float = MOST_OUTLIERS) -> np.ndarray:
    """(N,) True where one or two samples of x (N,) stand out to the same side of both neighbours,
    further than all but a `share` of the samples do, than x bends around them, and than its own
    resolution lets it."""
    bad = np.zeros(len(x), dtype=bool)
    # Of the middle, so that the outliers do not raise it themselves.
    low, high = np.percentile(x, [1.0, 99.0])
    spread = float(np.std(np.clip(x, low, high)))
    least, bends = FAR * common_quantisation_step([x]), np.abs(np.diff(x, 2)) / 2.0
    for width in (1, 2):
        out = _standing_out(x, width)
        limit = FAR * float(np.quantile(out, 1.0 - share))
        for k in np.flatnonzero(out > max(limit, OF_SPREAD * spread, least, 1e-12)):
            # A current may be quiet at rest and chatter where a joint moves.
            before = bends[max(k - 2 - LONGEST_CONSTANT_RUN, 0) : max(k - 2, 1)]
            after = bends[k + width :][:LONGEST_CONSTANT_RUN]
            if out[k] > FAR * max(map(np.median, (before, after)) if len(after) else [0.0]):
                bad[k : k + width] = True
    return bad


def _standing_out(x: np.ndarray, width: int) -> np.ndarray:
    """(N,) by how much samples k to k + width - 1 stand out; 0 where they do not."""
    out = np.zeros(len(x))
    n = len(x) - width - 1
    if n < 1:
        return out
    left, right = x[:n], x[width + 1 : width + 1 + n]
    up = np.min([x[1 + j : 1 + j + n] for j in range(width)], axis=0) - np.maximum(left, right)
    down = np.minimum(left, right) - np.max([x[1 + j : 1 + j + n] for j in range(width)], axis=0)
    # The neighbours must agree: a step of a torque is no outlier.
    out[1 : 1 + n] = np.maximum(np.maximum(up, down) - np.abs(left - right), 0.0)
    return out


BANDS, LOWEST = 8, 0.2
"""Bands of frequency, from this share of the sample rate upwards."""


def quiet_noise(x: np.ndarray) -> float:
    """Standard deviation of white noise in x (N,), by the band of frequencies with the least in it
    (spectrum: Welch 1967): a lively motion reaches up to half the sample rate, but not evenly."""
    if len(x) < 8 * BANDS:
        return noise_of(x)
    frequencies, power = scipy.signal.welch(np.diff(x), nperseg=min(len(x) - 1, 256))
    white = power / (2.0 * np.sin(np.pi * np.maximum(frequencies, 1e-9))) ** 2
    high = white[frequencies > LOWEST]
    least = min(float(np.mean(band)) for band in np.array_split(high, BANDS))
    return float(np.sqrt(least / 2.0))  # one-sided over a bandwidth of one half
