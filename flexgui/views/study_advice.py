"""Where a bias comes from, and what each candidate experiment would give."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from core.montecarlo.comparison import BiasSource
from core.montecarlo.estimates import EstimateTable, comparable, implied_bias
from core.montecarlo.planning import Candidate, Planning
from core.montecarlo.printed import LOCALS
from flexgui.views import colours
from flexgui.views.layout import styled
from flexgui.views.study_estimates import EXCITATIONS, RATES, angle, percent, signed, snr
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


SHOWN = 15
"""Candidates in the table."""


def planning_figure(plan: Planning) -> go.Figure:
    """Expected deviation of the first target over theta2, a line per excitation."""
    figure = go.Figure()
    names = list(dict.fromkeys(c.experiment.name for c in plan.candidates))
    for k, name in enumerate(sorted(names)):
        mine = sorted(
            (c for c in plan.candidates if c.experiment.name == name),
            key=lambda c: c.experiment.theta2,
        )
        figure.add_scatter(
            x=[float(np.degrees(c.experiment.theta2)) for c in mine],
            y=[100.0 * c.expected[0].std for c in mine],
            customdata=[100.0 * c.expected[0].bias for c in mine],
            mode="lines+markers",
            name=name,
            line={"color": colours.series(k)},
            hovertemplate="%{x:.0f}°: %{y:.3f} %, bias %{customdata:+.3f} %",
        )
    figure.update_xaxes(title_text="working point θ₂ [°]")
    figure.update_yaxes(title_text=f"deviation of {plan.targets[0]} [%]", rangemode="tozero")
    seconds = plan.candidates[0].experiment.seconds if plan.candidates else 0.0
    text = f"Of one experiment of {seconds:g} s with the noise of {plan.snr_db:g} dB data."
    return styled(figure, 400, text)


def candidate_table(plan: Planning) -> Table:
    """The best candidates, and which of them make the best plan together."""
    columns = [Column("Experiment"), Column("θ₂ [°]", numeric=True), Column("s", numeric=True)]
    for name in plan.targets:
        columns += [Column(f"std of {name}", numeric=True), Column("bias", numeric=True)]
    columns.append(Column("in the plan"))
    listed = [*plan.candidates[:SHOWN]]
    listed += [c for c in plan.chosen if c not in listed]
    rows = [_candidate(c, c in plan.chosen) for c in listed]
    text = (
        "Best first by the root of deviation² + bias². The bias is the linear model's own error on "
        "that motion; more seconds do not lower it."
    )
    return Table(tuple(columns), tuple(rows), text)


def _candidate(c: Candidate, chosen: bool) -> Row:
    cells = [
        c.experiment.name,
        f"{np.degrees(c.experiment.theta2):.0f}",
        f"{c.experiment.seconds:g}",
    ]
    for e in c.expected:
        cells += [percent(e.std), signed(e.bias)]
    return Row((*cells, "yes" if chosen else ""), strong=chosen)


def length_table(plan: Planning) -> Table:
    """Length of each experiment against the deviation of the first target."""
    columns = (
        Column("s per experiment", numeric=True),
        Column(f"std of {plan.targets[0]}, the study's experiments", numeric=True),
    )
    rows = tuple(Row((f"{seconds:g}", percent(std))) for seconds, std in plan.lengths)
    return Table(columns, rows, "At the noise of the study's own noisy data.")


def predicted_table(plan: Planning) -> Table:
    """Fisher information against the Monte Carlo."""
    columns = (
        Column("Fit"), Column("quantity"), Column("predicted", numeric=True),
        Column("found", numeric=True), Column("found / predicted", numeric=True),
    )  # fmt: skip
    rows = tuple(
        Row(
            (
                p.label,
                p.target,
                percent(p.predicted),
                percent(p.found),
                f"{p.ratio:.2f}",
            )
        )
        for p in plan.predicted
    )
    return Table(columns, rows, "Relative standard deviation of EI.")
