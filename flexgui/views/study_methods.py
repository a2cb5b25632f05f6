"""Other methods on the same data, and the validation sweeps (the paper's Fig. 2) with their FIT."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from core.montecarlo.comparison import LEVELS, BaselineRow, Validation
from core.montecarlo.printed import FITS
from core.written import format_number
from flexgui.views import colours
from flexgui.views.layout import styled
from flexgui.views.names import format_percent
from flexgui.views.study_estimates import percent, snr
from flexgui.views.table import Column, Row, Table

CLIP = 60.0
"""% of FIT: the axis ends here; what is worse lies on its edge."""


def baseline_table(rows: Sequence[BaselineRow]) -> Table:
    """All rows in figures."""
    columns = (
        Column("Points", numeric=True), Column("SNR"), Column("Method"),
        Column("FIT, own points [%]", numeric=True), Column("FIT, unseen [%]", numeric=True),
        Column("FIT, sweeps [%]", numeric=True), Column("pole error", numeric=True),
        Column("numbers", numeric=True), Column("time [s]", numeric=True), Column("result"),
    )  # fmt: skip
    shown = []
    for r in rows:
        fits = [format_percent(r.fit[k]) for k in ("identified", "unseen", "sweeps")]
        time = format_number(r.seconds, 2)
        cells = (str(r.points), snr(r.snr_db), r.method, *fits, percent(r.pole_error, 2))
        cells = (*cells, str(r.parameters), time, r.note)
        shown.append(Row(cells, strong=r.method == "glocal"))
    text = (
        "FIT on noise-free recordings that no method has seen, mean over recordings and both "
        "velocities. Pole error: mean relative distance of the poles below 1000 rad/s from the "
        "true ones over the range of θ₂. Numbers: entries that were estimated from data."
    )
    return Table(columns, tuple(shown), text)


def conclusion_table(rows: Sequence[BaselineRow]) -> Table:
    """What each row of the baseline table says."""
    columns = (
        Column("Points", numeric=True),
        Column("SNR"),
        Column("Method"),
        Column("Conclusion"),
    )
    shown = [
        Row((str(r.points), snr(r.snr_db), r.method, r.sentence), strong=r.method == "glocal")
        for r in rows
    ]
    return Table(columns, tuple(shown))


def baseline_figure(rows: Sequence[BaselineRow]) -> go.Figure | None:
    """FIT on sweeps over the number of points, one panel per ratio."""
    if not rows:
        return None
    ratios = list(dict.fromkeys(r.snr_db for r in rows))
    methods = list(dict.fromkeys(r.method for r in rows))
    figure = make_subplots(
        1, len(ratios), shared_yaxes=True, subplot_titles=[snr(s) for s in ratios]
    )
    for column, ratio in enumerate(ratios, start=1):
        for k, method in enumerate(methods):
            mine = [r for r in rows if r.snr_db == ratio and r.method == method]
            figure.add_scatter(
                x=[str(r.points) for r in mine],
                y=[max(r.fit["sweeps"], CLIP) for r in mine],
                customdata=[r.fit["sweeps"] for r in mine],
                mode="lines+markers",
                name=method,
                legendgroup=method,
                showlegend=column == 1,
                line={"color": colours.series(k)},
                hovertemplate="%{x} points: %{customdata:.2f} %",
                row=1,
                col=column,
            )
        figure.update_xaxes(title_text="working points", type="category", row=1, col=column)
    figure.update_yaxes(title_text="FIT on sweeps [%]", row=1, col=1)
    text = f"Average FIT on noise-free sweeps; below {CLIP:g} % on the edge."
    styled(figure, 400, text)
    return figure.update_layout(legend={"y": 1.12}, margin={"t": 72})


def pole_figure(
    rows: Sequence[BaselineRow], points: int, low: float, high: float
) -> go.Figure | None:
    """Pole error over theta2 (rad) for one number of points, noisy data."""
    mine = [r for r in rows if r.points == points and r.snr_db is not None]
    if not mine:
        return None
    ratio = max(r.snr_db for r in mine if r.snr_db is not None and r.snr_db <= 20.0)
    figure = go.Figure()
    for k, r in enumerate(r for r in mine if r.snr_db == ratio):
        figure.add_scatter(
            x=np.degrees(np.linspace(low, high, len(r.pole_errors))),
            y=100.0 * np.maximum(r.pole_errors, 1e-6),
            mode="lines+markers", name=r.method, line={"color": colours.series(k)},
            hovertemplate="%{x:.0f}°: %{y:.3g} %",
        )  # fmt: skip
    figure.update_xaxes(title_text="θ₂ [°]")
    figure.update_yaxes(title_text="pole error [%]", type="log")
    return styled(figure, 380, f"Estimated from {points} working points at {snr(ratio)}.")


OUTPUTS = ("ȳ₁", "ȳ₂")


def sweep_path(checked: Validation) -> go.Figure:
    """theta2 over time."""
    figure = go.Figure()
    figure.add_scatter(
        x=checked.time, y=np.degrees(checked.theta2), mode="lines",
        line={"color": colours.MEASURED, "width": 2}, showlegend=False,
        hovertemplate="%{x:.2f} s: %{y:.1f}°<extra></extra>",
    )  # fmt: skip
    figure.update_xaxes(title_text="time [s]")
    figure.update_yaxes(title_text="θ₂ [°]")
    text = (
        "Fig. 2 of the paper: the second joint in one validation sweep, a half-cosine and a PRBS."
    )
    return styled(figure, 300, text)


def sweep_fits(checked: Validation) -> go.Figure:
    """FIT of both velocities over the sweeps, by model."""
    figure = go.Figure()
    for k, (level, name) in enumerate(LEVELS.items()):
        for output in range(2):
            figure.add_scatter(
                x=list(checked.sweeps),
                y=checked.fits[level][:, output],
                mode="lines+markers",
                name=f"{name}, {OUTPUTS[output]}",
                line={"color": colours.series(k), "dash": "dot" if output else "solid"},
                marker={"size": 7},
                hovertemplate="sweep %{x}: %{y:.2f} %",
            )
    ends = [checked.sweeps[0], checked.sweeps[-1]]
    for output, value in enumerate(FITS):
        figure.add_scatter(
            x=ends, y=[value, value], mode="lines", name=f"paper, LPV, {OUTPUTS[output]}",
            line={"color": colours.RESIDUAL, "width": 1.5, "dash": "dot" if output else "solid"},
            hovertemplate="paper: %{y:.1f} %",
        )  # fmt: skip
    figure.update_xaxes(title_text="sweep", dtick=1)
    figure.update_yaxes(title_text="FIT [%]")
    return styled(figure, 380, "Noise-free sweeps; the estimates come from noisy recordings.")


def sweep_table(checked: Validation) -> Table:
    """A row per sweep and the mean."""
    columns = [Column("Sweep")]
    for name in LEVELS.values():
        columns += [Column(f"{name}, {output} [%]", numeric=True) for output in OUTPUTS]
    rows = []
    for k, number in enumerate(checked.sweeps):
        cells = [format_percent(v) for level in LEVELS for v in checked.fits[level][k]]
        rows.append(Row((str(number), *cells)))
    means = [format_percent(v) for level in LEVELS for v in checked.mean(level)]
    rows.append(Row(("mean", *means), strong=True))
    text = f"The paper: {FITS[0]} and {FITS[1]} % with its LPV model."
    return Table(tuple(columns), tuple(rows), text)
