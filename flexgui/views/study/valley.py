"""Where the pairs (ε, d) lie: on the valley, inside the box of the prior."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from core.montecarlo.agreement import comparable
from core.montecarlo.estimates import EstimateTable
from core.montecarlo.valley import ValleyPrior
from flexgui.views import colours
from flexgui.views.layout import styled
from flexgui.views.study.words import snr

GPA, MM = 1e-9, 1e3
SYMBOLS = {None: "circle", 20.0: "diamond"}


def study_valley(
    tables: Sequence[EstimateTable], prior: ValleyPrior | None, true_EI: float
) -> go.Figure | None:
    """Every run's pair, the paper's means, the curve ε d⁴ = const and the prior; None where ε
    and d are not what was estimated."""
    if not tables or {"epsilon", "d"} != set(tables[0].rows[0].values):
        return None
    figure = go.Figure()
    pairs = [p for t in tables for row in t.rows for p in row.pairs]
    low = min(p["epsilon"] for p in pairs)
    high = max(p["epsilon"] for p in pairs)
    if prior is not None:
        low, high = prior.bounds["epsilon"]
        _add_box(figure, prior)
    _add_curve(figure, low, high, true_EI)
    for table in tables:
        _add_ours(figure, table)
    for table in tables:
        _add_paper(figure, table)
    figure.update_xaxes(title_text="ε [GPa]")
    figure.update_yaxes(title_text="d [mm]")
    text = ["Dots: every fit of every run.", "Curve: all pairs with the true EI."]
    if any(comparable(table) is not None for table in tables):
        text.insert(1, "Large marks: the paper's means.")
    if prior is not None:
        text.append("Box: the prior, in which the first population is drawn.")
    return styled(figure, 480, " ".join(text), hovermode="closest")


def _add_box(figure: go.Figure, prior: ValleyPrior) -> None:
    (x0, x1), (y0, y1) = prior.bounds["epsilon"], prior.bounds["d"]
    x, y = np.array([x0, x1, x1, x0, x0]) * GPA, np.array([y0, y0, y1, y1, y0]) * MM
    line = {"color": colours.BOUND, "width": 1.2, "dash": "dot"}
    figure.add_scatter(x=x, y=y, mode="lines", name="prior", line=line, hoverinfo="skip")


def _add_curve(figure: go.Figure, low: float, high: float, EI: float) -> None:
    epsilon = np.linspace(low, high, 201)
    d = (12.0 * EI / epsilon) ** 0.25
    figure.add_scatter(
        x=epsilon * GPA, y=d * MM, mode="lines", name="ε d⁴ = const",
        line={"color": colours.MODEL, "width": 2}, hoverinfo="skip",
    )  # fmt: skip


def _add_ours(figure: go.Figure, table: EstimateTable) -> None:
    single = [(row, k, p) for row in table.rows for k, p in enumerate(row.pairs)]
    single = [s for s in single if s[0].label != "local mean"]
    colour = colours.MEASURED if table.snr_db is None else colours.ADDED
    figure.add_scatter(
        x=[p["epsilon"] * GPA for _, _, p in single],
        y=[p["d"] * MM for _, _, p in single],
        mode="markers",
        name=f"here, {snr(table.snr_db)}",
        marker={"color": colours.faded(colour, 0.55), "size": 6},
        text=[f"{row.label}, run {k + 1}" for row, k, _ in single],
        hovertemplate="%{text}<br>%{x:.4f} GPa, %{y:.2f} mm<extra></extra>",
    )


def _add_paper(figure: go.Figure, table: EstimateTable) -> None:
    told = comparable(table)
    if told is None:
        return
    figure.add_scatter(
        x=[n[0] for n in told],
        y=[n[2] for n in told],
        mode="markers",
        name=f"paper, {snr(table.snr_db)}",
        marker={
            "color": colours.RESIDUAL,
            "size": 11,
            "symbol": SYMBOLS.get(table.snr_db, "square"),
            "line": {"width": 1, "color": colours.HOVER_BACKGROUND},
        },
        text=[row.label for row in table.rows],
        hovertemplate="paper, %{text}<br>%{x:.4f} GPa, %{y:.1f} mm<extra></extra>",
    )
