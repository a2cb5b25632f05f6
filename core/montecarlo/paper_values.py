"""What the paper prints."""

from __future__ import annotations

import math
from collections.abc import Sequence

WORKING_POINTS = tuple(k * math.pi / 8.0 for k in range(1, 8))
"""rad"""

Numbers = tuple[float, float, float, float]
"""ε in GPa, its deviation, d in mm, its deviation."""

SNR_NONE: tuple[Numbers, ...] = (
    (1.0198, 0.1035, 50.6, 1.5), (0.9976, 0.1469, 50.9, 1.8), (1.0579, 0.1345, 49.9, 1.7),
    (0.9622, 0.1283, 50.9, 1.7), (1.0203, 0.0963, 49.9, 1.2), (1.0767, 0.1075, 49.0, 1.3),
    (0.9742, 0.1272, 50.2, 1.7), (1.0155, 0.0460, 50.3, 0.594), (1.0098, 0.0924, 50.2, 1.3),
)  # fmt: skip
"""Seven local, their mean, glocal; no noise."""

SNR_20: tuple[Numbers, ...] = (
    (0.9156, 0.1105, 52.7, 2.2), (1.0121, 0.1377, 51.4, 2.6), (0.9652, 0.1169, 51.3, 1.8),
    (1.0066, 0.1304, 51.2, 2.1), (0.9646, 0.0897, 50.6, 1.6), (1.0162, 0.1836, 50.2, 3.0),
    (0.9599, 0.1128, 50.8, 2.2), (0.9771, 0.0487, 51.2, 0.853), (0.9833, 0.0935, 50.6, 1.3),
)  # fmt: skip
"""The same at 20 dB."""

LABELS = (*(f"local {k}π/8" for k in range(1, 8)), "local mean", "glocal")
LOCALS, MEAN, GLOCAL = range(7), 7, 8

FITS = (96.8, 97.1)
"""%, average FIT of the two velocities over ten validation sweeps."""

_BY_SNR: dict[float | None, tuple[Numbers, ...]] = {None: SNR_NONE, 20.0: SNR_20}


def printed(snr_db: float | None) -> tuple[Numbers, ...] | None:
    """The table of `snr_db` in dB (None: no noise), where the paper has one."""
    return _BY_SNR.get(snr_db)


def stiffness(epsilon: float, d: float) -> float:
    """EI in N m² of the square section, `epsilon` in GPa and `d` in mm."""
    return epsilon * 1e9 * (d * 1e-3) ** 4 / 12.0


def deviation_of_mean(deviations: Sequence[float]) -> float:
    """Of the mean of independent estimates: sqrt(sum std²) / n, which the paper's numbers obey."""
    return math.sqrt(math.fsum(s * s for s in deviations)) / len(deviations)


def caption_deviation(deviations: Sequence[float]) -> float:
    """sqrt(sum std² / n), as the paper's caption says; its numbers do not obey it."""
    return math.sqrt(math.fsum(s * s for s in deviations) / len(deviations))
