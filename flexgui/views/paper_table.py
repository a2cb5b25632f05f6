"""The paper's results beside ours, where ours come from the paper's experiments."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from core.results import Estimate, Fit
from flexgui.views.numbers import format_number
from flexgui.views.table import Column, Row, Table

WORKING_POINTS = tuple(k * math.pi / 8.0 for k in range(1, 8))
"""rad"""

SNR_NONE: tuple[tuple[float, float, float, float], ...] = (
    (1.0198, 0.1035, 50.6, 1.5), (0.9976, 0.1469, 50.9, 1.8), (1.0579, 0.1345, 49.9, 1.7),
    (0.9622, 0.1283, 50.9, 1.7), (1.0203, 0.0963, 49.9, 1.2), (1.0767, 0.1075, 49.0, 1.3),
    (0.9742, 0.1272, 50.2, 1.7), (1.0155, 0.0460, 50.3, 0.594), (1.0098, 0.0924, 50.2, 1.3),
)  # fmt: skip
"""ε in GPa, its deviation, d in mm, its deviation: seven local, their mean, glocal; no noise."""

SNR_20: tuple[tuple[float, float, float, float], ...] = (
    (0.9156, 0.1105, 52.7, 2.2), (1.0121, 0.1377, 51.4, 2.6), (0.9652, 0.1169, 51.3, 1.8),
    (1.0066, 0.1304, 51.2, 2.1), (0.9646, 0.0897, 50.6, 1.6), (1.0162, 0.1836, 50.2, 3.0),
    (0.9599, 0.1128, 50.8, 2.2), (0.9771, 0.0487, 51.2, 0.853), (0.9833, 0.0935, 50.6, 1.3),
)  # fmt: skip
"""The same at 20 dB."""

LABELS = (*(f"local {k}π/8" for k in range(1, 8)), "local mean", "glocal")
MEAN, GLOCAL = 7, 8

COLUMNS = (
    Column("Fit"),
    Column("paper ε [GPa]", numeric=True),
    Column("ours", numeric=True),
    Column("paper d [mm]", numeric=True),
    Column("ours", numeric=True),
    Column("paper EI [N m²]", numeric=True),
    Column("ours", numeric=True),
)


def paper_table(fits: Sequence[Fit], points: Sequence[float], noisy: bool) -> Table:
    """A row per fit of the paper; `points` are the working points (rad) of the local fits."""
    ours: dict[int, dict[str, Estimate]] = {}
    if len(fits) == 1:
        ours[GLOCAL] = _named(fits[0])
    else:
        for fit, point in zip(fits, points, strict=False):
            ours[int(np.argmin(np.abs(np.array(WORKING_POINTS) - point)))] = _named(fit)
    told = SNR_20 if noisy else SNR_NONE
    rows = [_row(k, numbers, _ours(k, ours)) for k, numbers in enumerate(told)]
    text = (
        "Paper: mean ± deviation of 20 runs; its EI follows from the means. Ours: this one run. "
        "Alone ε and d are not determined, so they may differ along the valley; EI must not."
    )
    return Table(COLUMNS, tuple(rows), text)


def _named(fit: Fit) -> dict[str, Estimate]:
    return {e.name: e for e in (*fit.estimates, *fit.derived)}


def _ours(k: int, ours: dict[int, dict[str, Estimate]]) -> dict[str, float]:
    local = [found for place, found in ours.items() if place < MEAN]
    if k == MEAN and len(local) > 1:
        names = set.intersection(*(set(found) for found in local))
        return {n: float(np.mean([found[n].value for found in local])) for n in names}
    return {name: e.value for name, e in ours.get(k, {}).items()}


def _row(k: int, told: tuple[float, float, float, float], ours: dict[str, float]) -> Row:
    eps, eps_std, d, d_std = told
    stiffness = eps * 1e9 * (d * 1e-3) ** 4 / 12.0
    nan = float("nan")
    cells = (
        LABELS[k],
        f"{eps:.4f} ± {eps_std:.4f}",
        format_number(ours.get("epsilon", nan) * 1e-9, 5, keep_zeros=True),
        f"{d:.1f} ± {d_std:.3g}",
        format_number(ours.get("d", nan) * 1e3, 4, keep_zeros=True),
        f"{stiffness:.1f}",
        format_number(ours.get("EI", nan), 5, keep_zeros=True),
    )
    return Row(cells, strong=bool(ours))
