"""What of an encoder's reading its own past, the other joints and the drive do not foretell.

A motion obeys equations: from enough samples before it, of all joints and of what drives them, the
next place of a joint follows nearly linearly, whatever the arm is and whatever the model lacks of
it. What an encoder adds by counting is new in each sample. So for any weights a of 1 + LAGS samples
of a joint, and any of the other signals, the rms of the weighted sum is at least |a| times the
noise. The least such ratio is a singular value of the samples side by side, once the other signals
are projected out of them (total least squares): a bound from above that needs no model.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.diagnose.sensor_noise import NORMAL_MAD
from core.recording.beginning import FEWEST_PER_COLUMN, LAGS
from core.recording.recording import Recording

MOST_SAMPLES = 4000
"""Of all recordings together; the deviation of 4000 samples is good to a hundredth."""

MOST_RECORDINGS = 16
"""An encoder is the same in all, and of each enough samples in a row are needed."""


def unforeseen(recordings: Sequence[Recording], name: str, others: Sequence[str]) -> float | None:
    """Standard deviation of the white noise in a column, its steps included, at most; None where
    the recordings are too short to say. `others`: joints, and what drives them.

    It holds for all recordings together and for each alone: a calm one tells less of the ripples
    and the friction that no linear equation foretells.
    """
    able = [r for r in recordings if r.has(name, *others) and _complete(r, [name, *others])]
    able = able[:MOST_RECORDINGS]
    if not able:
        return None
    bounds = [_least(able, name, others, 1)]
    if len(able) > 1:
        bounds += [_least([r], name, others, len(able)) for r in able]
    return min((x for x in bounds if x is not None), default=None)


def _least(
    recordings: Sequence[Recording], name: str, others: Sequence[str], chosen_of: int
) -> float | None:
    """The bound from some recordings, the least of so many; None where they are too short."""
    each = MOST_SAMPLES // len(recordings)
    own = np.vstack([_lagged(r[name][:each]) for r in recordings])
    beside = [np.vstack([_lagged(r[n][:each]) for r in recordings]) for n in others]
    known = np.hstack([np.ones((len(own), 1)), *beside])
    free = len(own) - known.shape[1]
    if free < FEWEST_PER_COLUMN * own.shape[1]:
        return None
    scales = np.maximum(np.linalg.norm(known, axis=0), 1e-300)
    base, sizes, _ = np.linalg.svd(known / scales, full_matrices=False)
    base = base[:, sizes > 1e-12 * sizes[0]]
    left = own - base @ (base.T @ own)
    rest = left @ np.linalg.svd(left, full_matrices=False)[2][-1]
    # The median is not moved by the few instants at which a dry friction turns.
    middle = float(np.median(np.abs(rest))) / NORMAL_MAD
    level = min(float(np.sqrt(np.mean(rest**2))), middle) * np.sqrt(len(rest) / free)
    # The least of several deviations of noise alone lies below it by chance: at most, on average,
    # sqrt(2 ln n) of their own deviations 1 / sqrt(2 free).
    level *= 1.0 + np.sqrt(np.log(chosen_of) / free)
    # The least singular value of white noise alone (Marchenko and Pastur, 1967).
    return float(level / (1.0 - np.sqrt(own.shape[1] / free)))


def _complete(recording: Recording, names: Sequence[str]) -> bool:
    return all(np.isfinite(recording[n]).all() for n in names) and len(recording.time) > LAGS


def _lagged(x: np.ndarray) -> np.ndarray:
    """(N - LAGS, 1 + LAGS) of x (N,)."""
    return np.lib.stride_tricks.sliding_window_view(x, LAGS + 1)
