"""What a study says beyond its estimates: other methods on the same data, the validation sweeps
(the paper's Fig. 2) with their FIT, where a bias comes from, and what each candidate experiment
gives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from flexgui.core.montecarlo.estimates import EstimateTable, comparable, implied_bias
from flexgui.core.montecarlo.planning import Candidate, Planning
from flexgui.core.montecarlo.printed import FITS, LOCALS
from flexgui.core.montecarlo.summary import LEVELS, BaselineRow, BiasSource, Validation
from flexgui.sentences.written import format_number
from flexgui.stages.study.baselines import conclusions, result_words, snr
from flexgui.stages.study.plots_estimates import EXCITATIONS, RATES, angle, percent, signed
from flexgui.views import colours
from flexgui.views.layout import styled
from flexgui.views.names import format_percent
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
        cells = (*cells, str(r.parameters), time, result_words(r))
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
        Row((str(r.points), snr(r.snr_db), r.method, conclusion), strong=r.method == "glocal")
        for r, conclusion in zip(rows, conclusions(rows), strict=True)
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
        published = comparable(table)
        if published is not None:
            implied = [100.0 * implied_bias(published[k], true_EI) for k in LOCALS]
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
