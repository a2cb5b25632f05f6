"""The paper's results beside ours, where ours come from the paper's experiments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.montecarlo.printed import GLOCAL, LABELS, MEAN, SNR_20, SNR_NONE, WORKING_POINTS
from core.results import Estimate, Fit
from flexgui.views.numbers import format_number
from flexgui.views.table import Column, Row, Table

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
