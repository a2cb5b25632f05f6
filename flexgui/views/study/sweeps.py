"""The path of a validation sweep (the paper's Fig. 2) and the FIT over all of them."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from core.montecarlo.printed import FITS
from core.montecarlo.validation import LEVELS, Validation
from flexgui.views import colours
from flexgui.views.layout import styled
from flexgui.views.numbers import format_percent
from flexgui.views.table import Column, Row, Table

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
