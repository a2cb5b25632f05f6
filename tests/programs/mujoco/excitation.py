"""References of the joints' velocities, in rad/s, one row per sample."""

from __future__ import annotations

import numpy as np

SAMPLE = 0.002
"""s between two rows of a recording."""
HOLD = 0.020
"""s that the drive keeps one value of the binary sequence."""
AMPLITUDE = 0.3
"""rad/s."""
RATE_DECIMALS = 6
"""of a reference in rad/s."""


def prbs(seconds: float, seed: int) -> np.ndarray:
    """(samples, 2) of ±0.3 rad/s: two balanced sequences, as uncorrelated as their length allows.

    Each value is held 20 ms and followed by its negative, so that no joint wanders. The last
    row, where the recording ends, is zero.
    """
    held = round(HOLD / SAMPLE)
    pairs = round(seconds / HOLD) // 2
    bits = _bits(pairs, np.random.default_rng(seed))
    values = np.stack([bits, -bits], axis=1).reshape(2 * pairs, 2)
    rates = np.zeros((round(seconds / SAMPLE) + 1, 2))
    rates[: 2 * pairs * held] = AMPLITUDE * np.repeat(values, held, axis=0)
    return rates


def _bits(count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 2) of ±1, each column with a mean and both with a product of least size."""
    first = np.where(np.arange(count) % 2, 1.0, -1.0)
    least = 2 if count % 4 else 0  # what parity leaves of the inner product
    while True:
        bits = np.stack([rng.permutation(first), rng.permutation(first)], axis=1)
        if abs(bits[:, 0] @ bits[:, 1]) <= least:
            return bits


def sweep(start: float, end: float, seconds: float, sample_time: float = SAMPLE) -> np.ndarray:
    """(samples, 2): joint 2 goes from `start` to `end` in rad by a half cosine, joint 1 rests."""
    times = sample_time * np.arange(round(seconds / sample_time) + 1)
    # What the joint is to have turned at each sample; a held rate is the mean between two of them.
    angle = start + (end - start) * (1 - np.cos(np.pi * times / seconds)) / 2
    rates = np.append(np.diff(angle) / sample_time, 0.0)
    return np.stack([np.zeros(len(times)), rates], axis=1)
