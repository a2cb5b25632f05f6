"""The bias in EI that the paper's means imply, and where a bias comes from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from core.montecarlo.agreement import comparable, implied_bias
from core.montecarlo.estimates import EstimateTable
from core.montecarlo.printed import LOCALS
from core.montecarlo.sources import BiasSource
from flexgui.views import colours
from flexgui.views.layout import styled
from flexgui.views.study.words import EXCITATIONS, RATES, angle, percent, signed, snr
from flexgui.views.table import Column, Row, Table


def bias_figure(
    tables: Sequence[EstimateTable], sources: Sequence[BiasSource], true_EI: float
) -> go.Figure | None:
    """Bias over the working points: implied by the paper, found here, and bands of its sources."""
    if not tables or not tables[0].locals:
        return None
    names = [angle(row.theta2 or 0.0) for row in tables[0].locals]
    figure = go.Figure()
    for k, source in enumerate(s for s in sources if s.rates != "encoders"):
        _add_band(figure, source, names, colours.series(k + 2))
    for table in tables:
        told = comparable(table)
        if told is not None:
            implied = [100.0 * implied_bias(told[k], true_EI) for k in LOCALS]
            _add_line(
                figure, names, implied, f"paper, {snr(table.snr_db)}", colours.RESIDUAL, table
            )
        ours = [100.0 * (row.EI[0].mean / true_EI - 1.0) for row in table.locals]
        _add_line(figure, names, ours, f"here, {snr(table.snr_db)}", colours.MEASURED, table)
    figure.update_xaxes(title_text="working point θ₂", type="category")
    figure.update_yaxes(title_text="bias of EI [%]")
    text = (
        "Lines: bias of the mean EI. Bars: ± the root mean square bias of noise-free fits over "
        "many draws of the excitation."
    )
    return styled(figure, 420, text)


def _add_band(figure: go.Figure, s: BiasSource, names: list[str], colour: str) -> None:
    size = 100.0 * s.rms
    figure.add_bar(
        x=names, y=2.0 * size, base=-size, width=0.5, name=_called(s),
        marker={"color": colours.faded(colour, 0.35)}, customdata=size,
        hovertemplate="± %{customdata:.2f} %",
    )  # fmt: skip
    figure.update_layout(barmode="overlay")


def _add_line(  # noqa: D103
    figure: go.Figure, x: list[str], y: list[float], name: str, colour: str, table: EstimateTable
) -> None:
    dash = "solid" if table.snr_db is None else "dot"
    figure.add_scatter(
        x=x, y=y, mode="lines+markers", name=name, line={"color": colour, "dash": dash},
        hovertemplate="%{y:+.2f} %",
    )  # fmt: skip


def bias_table(sources: Sequence[BiasSource], points: Sequence[float]) -> Table:
    """Root mean square bias of each source at each working point, and of the glocal fit."""
    columns = [Column("Excitation"), Column("ȳ computed with"), Column("θ₂ wanders", numeric=True)]
    columns += [Column(angle(p), numeric=True) for p in points]
    columns.append(Column("glocal", numeric=True))
    rows = []
    for s in sources:
        means = (*s.local.mean(axis=0), s.glocal.mean())
        sizes = (*s.rms, s.glocal_rms)
        cells = [_pair(float(v), float(m)) for v, m in zip(sizes, means, strict=True)]
        wander = f"{float(np.mean(s.wander)):.3f} rad"
        rows.append(Row((EXCITATIONS[s.excitation], RATES[s.rates], wander, *cells)))
    count = len(sources[0].local) if sources else 0
    text = (
        f"Root mean square over {count} draws of the excitation, the mean in brackets; no noise, "
        f"EI alone fitted."
    )
    return Table(tuple(columns), tuple(rows), text)


def _pair(rms: float, mean: float) -> str:
    return f"{percent(rms, 2)} ({signed(mean).removesuffix(' %')})"


def _called(s: BiasSource) -> str:
    return f"{EXCITATIONS[s.excitation]}, {RATES[s.rates]}"
