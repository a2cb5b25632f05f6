"""Experiment advice: what each candidate would give, and how well predictions held."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from core.montecarlo.planning import Candidate, Planning
from flexgui.views import colours
from flexgui.views.layout import styled
from flexgui.views.study.words import percent, signed
from flexgui.views.table import Column, Row, Table

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
