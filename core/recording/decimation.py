"""Recordings with fewer samples: every so many instants, nothing folded down.

What is measured passes a symmetric low-pass before instants are left out, so that noise and
vibration above the new band do not return as something slower, and the noise of a sample falls
as it would by averaging.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import numpy as np
import scipy

from ..recording.recording import Recording

STOP_DB = 80.0
"""dB by which the low-pass takes down what would be folded: below 13 bit of what is measured."""

PASS, STOP = 0.2, 0.8
"""Of the new rate: up to where nothing changes, and from where the low-pass stops; what lies
between half of the rate and STOP is folded to above PASS only."""


@cache
def low_pass(factor: int) -> np.ndarray:
    """(2 n + 1,) weights of the symmetric low-pass before one instant of `factor` is kept."""
    nyquist = 0.5 * factor  # of the samples, in units of the new rate
    count, beta = scipy.signal.kaiserord(STOP_DB, (STOP - PASS) / nyquist)
    count |= 1
    middle = 0.5 * (PASS + STOP) / nyquist
    return np.asarray(scipy.signal.firwin(count, middle, window=("kaiser", beta)))


def sentence(factor: int, dt: float) -> str:
    """The low-pass in words; dt in s is that of the samples before."""
    rate = 1.0 / (factor * dt)
    return (
        f"a symmetric FIR low-pass of {len(low_pass(factor))} samples (Kaiser window, nothing "
        f"changed below {PASS * rate:.3g} Hz, {STOP_DB:g} dB down above {STOP * rate:.3g} Hz)"
    )


def _stride(at: np.ndarray) -> int:
    return int(np.median(np.diff(at))) if len(at) > 1 else 1


def thinned(recording: Recording, factor: int, references: Iterable[str]) -> Recording:
    """Every factor-th instant of a recording; itself at a factor of one.

    References keep their mean over each stretch between two instants, which is what they are where
    they are held; everything else is as the low-pass leaves it. A sample counts where all samples
    that it is made of count, and is empty where one of a slower sensor is missing.
    """
    if factor == 1:
        return recording
    chosen, N = set(references), len(recording.time)
    channels, counted = {}, {}
    for name, x in recording.channels.items():
        at = np.flatnonzero(np.isfinite(x))
        if name in chosen:
            channels[name] = _mean_held(x, factor)
        elif len(at) < N and not np.any(at % factor):
            channels[name] = x[::factor].copy()
        else:
            channels[name] = _smooth(x, factor)
    for name, mask in recording.counted.items():
        at = np.flatnonzero(np.isfinite(recording[name]))
        picked = len(at) < N and not np.any(at % factor)
        counted[name] = mask[::factor].copy() if picked else _filter_complete(mask, factor)
    return replace(recording, time=recording.time[::factor], channels=channels, counted=counted)


def _mean_held(x: np.ndarray, factor: int) -> np.ndarray:
    """The mean of x (N,) from each kept instant to before the next."""
    starts = np.arange(0, len(x), factor)
    sums = np.add.reduceat(x, starts)
    means = sums / np.diff(np.append(starts, len(x)))
    # What is held is not touched by the rounding of a mean.
    same = np.maximum.reduceat(x, starts) == np.minimum.reduceat(x, starts)
    return np.where(same, x[starts], means)


def _smooth(x: np.ndarray, factor: int) -> np.ndarray:
    """x (N,) through the low-pass at the kept instants, continued point-symmetrically beyond its
    ends; a slower sensor's samples stand for those between them."""
    weights = low_pass(factor)
    half = len(weights) // 2
    sampled = np.isfinite(x)
    if sampled.all():
        ends = min(half, len(x) - 1)
        whole = np.pad(x, ends, mode="reflect", reflect_type="odd")
        whole = np.pad(whole, half - ends, mode="edge")
        return _at_instants(whole, weights, factor)
    stride = _stride(np.flatnonzero(sampled))
    sums = _at_instants(np.pad(np.where(sampled, x, 0.0), half), weights, factor)
    shares = _at_instants(np.pad(sampled.astype(float), half), weights, factor)
    present = _at_instants(np.pad(sampled.astype(float), half), np.ones(len(weights)), factor)
    complete = present > len(weights) // stride - 0.5
    return np.where(complete, sums / np.where(complete, shares, 1.0), np.nan)


def _filter_complete(mask: np.ndarray, factor: int) -> np.ndarray:
    """(ceil(N / factor),): whether all samples under the low-pass count."""
    width = len(low_pass(factor))
    missing = np.pad((~mask).astype(float), width // 2)
    return np.asarray(_at_instants(missing, np.ones(width), factor) < 0.5)


def _at_instants(padded: np.ndarray, weights: np.ndarray, factor: int) -> np.ndarray:
    """The sums of a window's samples times the (symmetric) weights, at every factor-th instant."""
    every = scipy.signal.upfirdn(weights, padded)[len(weights) - 1 : len(padded)]
    return np.asarray(every[::factor])


def first_part(recording: Recording, most: int) -> Recording:
    """The first `most` samples: a motion can be simulated from where it began."""
    return recording if most >= len(recording.time) else recording.rows(slice(most))
