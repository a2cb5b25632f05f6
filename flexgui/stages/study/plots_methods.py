"""What a study says beyond its estimates: other methods on the same data, the validation sweeps
(the paper's Fig. 2) with their FIT, where a bias comes from, and what each candidate experiment
gives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexgui.core.montecarlo.estimates import EstimateTable, comparable, implied_bias
from flexgui.core.montecarlo.paper_values import FITS, LOCALS
from flexgui.core.montecarlo.planning import Candidate, Planning
from flexgui.core.montecarlo.summary import LEVELS, BaselineRow, BiasSource, Validation
from flexgui.sentences.written import angle, format_number
from flexgui.stages.study.findings import GLOCAL, conclusions, result_text
from flexgui.stages.study.plots_estimates import (
    EXCITATIONS,
    RATES,
    percent,
    signed,
    snr,
)
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, figure, line, panes
from flexgui.views.names import format_percent
from flexgui.views.table import Row, Table, numbers, texts

MARKED = {"mode": "lines+markers", "width": 2}

CLIP = 60.0
"""% of FIT: the axis ends here; what is worse lies on its edge."""


def baseline_table(rows: Sequence[BaselineRow]) -> Table:
    """All rows in figures."""
    columns = (
        *numbers("Points"), *texts("SNR", "Method"),
        *numbers("FIT, own points [%]", "FIT, unseen [%]", "FIT, sweeps [%]", "pole error"),
        *numbers("numbers", "time [s]"), *texts("result"),
    )  # fmt: skip
    shown = []
    for r in rows:
        fits = [format_percent(r.fit[k]) for k in ("identified", "unseen", "sweeps")]
        effort = (percent(r.pole_error, 2), str(r.parameters), format_number(r.seconds, 2))
        cells = (str(r.points), snr(r.snr_db), r.method, *fits, *effort, result_text(r))
        shown.append(Row(cells, strong=r.method == GLOCAL))
    text = (
        "FIT on noise-free validation recordings, mean over recordings and both "
        "velocities. Pole error: mean relative distance from the true poles, below 1000 rad/s and "
        "over the range of θ₂. Numbers: entries estimated from data."
    )
    return Table(columns, tuple(shown), text)


def conclusion_table(rows: Sequence[BaselineRow]) -> Table:
    """What each row of the baseline table says."""
    shown = tuple(
        Row((str(r.points), snr(r.snr_db), r.method, conclusion), strong=r.method == GLOCAL)
        for r, conclusion in zip(rows, conclusions(rows), strict=True)
    )
    return Table((*numbers("Points"), *texts("SNR", "Method", "Conclusion")), shown)


def baseline_figure(rows: Sequence[BaselineRow]) -> Figure | None:
    """FIT on sweeps over the number of points, one panel per ratio."""
    if not rows:
        return None
    methods = list(dict.fromkeys(r.method for r in rows))
    hover = "%{x} points: %{customdata:.2f} %"
    parts: list[Pane] = []
    for ratio in dict.fromkeys(r.snr_db for r in rows):
        lines = []
        for k, method in enumerate(methods):
            mine = [r for r in rows if r.snr_db == ratio and r.method == method]
            x, fits = [str(r.points) for r in mine], [r.fit["sweeps"] for r in mine]
            y = [max(fit, CLIP) for fit in fits]
            lines.append(line(x, y, method, colours.series(k), hover, customdata=fits, **MARKED))
        y_axis = axis("" if parts else "FIT on sweeps [%]", matches="y" if parts else None)
        parts.append(Pane(lines, y_axis, axis("working points", type="category"), 1.0, snr(ratio)))
    text = f"Average FIT on noise-free sweeps; below {CLIP:g} % on the edge."
    drawn = panes(parts, None, text, 400, 0.08, len(parts))
    drawn["layout"]["legend"] |= {"y": 1.12}
    drawn["layout"]["margin"] |= {"t": 72}
    return drawn


def pole_figure(rows: Sequence[BaselineRow], points: int, low: float, high: float) -> Figure | None:
    """Pole error over theta2 from `low` to `high` in rad for one number of points, noisy data."""
    mine = [r for r in rows if r.points == points and r.snr_db is not None]
    if not mine:
        return None
    ratio = max(r.snr_db for r in mine if r.snr_db is not None and r.snr_db <= 20.0)
    lines = [
        line(
            np.degrees(np.linspace(low, high, len(r.pole_errors))),
            100.0 * np.maximum(r.pole_errors, 1e-6), r.method, colours.series(k),
            "%{x:.0f}°: %{y:.3g} %", **MARKED,
        )
        for k, r in enumerate(r for r in mine if r.snr_db == ratio)
    ]  # fmt: skip
    text = f"Estimated from {points} working points at {snr(ratio)}."
    return figure(lines, axis("θ₂ [°]"), axis("pole error [%]", type="log"), text, 380)


OUTPUTS = ("ȳ₁", "ȳ₂")
DASHES = ("solid", "dot")
"""Of the two."""


def sweep_path(checked: Validation) -> Figure:
    """theta2 over time."""
    path = line(
        checked.time, np.degrees(checked.theta2), "", colours.joint(1)["color"],
        "%{x:.2f} s: %{y:.1f}°<extra></extra>", width=2, showlegend=False,
    )  # fmt: skip
    text = (
        "Fig. 2 of the paper: the second joint in one validation sweep, a half-cosine and a PRBS."
    )
    return figure([path], axis("time [s]"), axis("θ₂ [°]"), text, 300)


def sweep_fits(checked: Validation) -> Figure:
    """FIT of both velocities over the sweeps, by model."""
    sweeps, hover = list(checked.sweeps), "sweep %{x}: %{y:.2f} %"
    lines = [
        line(
            sweeps, checked.fits[level][:, k], f"{name}, {output}", colours.series(n), hover,
            dash=dash, marker={"size": 7}, **MARKED,
        )
        for n, (level, name) in enumerate(LEVELS.items())
        for k, (output, dash) in enumerate(zip(OUTPUTS, DASHES, strict=True))
    ]  # fmt: skip
    for output, dash, value in zip(OUTPUTS, DASHES, FITS, strict=True):
        name, style = f"paper, LPV, {output}", {"width": 1.5, "dash": dash}
        ends = ([sweeps[0], sweeps[-1]], [value, value])
        lines.append(line(*ends, name, colours.REFERENCE, "paper: %{y:.1f} %", **style))
    text = "Noise-free sweeps; the estimates come from noisy recordings."
    return figure(lines, axis("sweep", dtick=1), axis("FIT [%]"), text, 380)


def sweep_table(checked: Validation) -> Table:
    """A row per sweep and the mean."""
    titles = [f"{name}, {output} [%]" for name in LEVELS.values() for output in OUTPUTS]
    by_sweep = {str(n): [checked.fits[v][k] for v in LEVELS] for k, n in enumerate(checked.sweeps)}
    by_sweep["mean"] = [checked.mean(level) for level in LEVELS]
    rows = tuple(
        Row((name, *(format_percent(v) for pair in fits for v in pair)), strong=name == "mean")
        for name, fits in by_sweep.items()
    )
    text = f"The paper: {FITS[0]} and {FITS[1]} % with its LPV model."
    return Table((*texts("Sweep"), *numbers(*titles)), rows, text)


def bias_figure(
    tables: Sequence[EstimateTable], sources: Sequence[BiasSource], true_EI: float
) -> Figure | None:
    """Bias from `true_EI` in N m² over the working points: implied by the paper, found here, and
    bands of its sources."""
    if not tables or not tables[0].locals:
        return None
    names = [angle(row.theta2 or 0.0) for row in tables[0].locals]
    traces: list[Figure] = []
    for k, s in enumerate(s for s in sources if s.rates != "encoders"):
        size = 100.0 * s.rms
        traces.append(
            {
                "type": "bar", "x": names, "y": 2.0 * size, "base": -size, "width": 0.5,
                "name": f"{EXCITATIONS[s.excitation]}, {RATES[s.rates]}",
                "marker": {"color": colours.faded(colours.series(k + 2), 0.35)},
                "customdata": size, "hovertemplate": "± %{customdata:.2f} %",
            }
        )  # fmt: skip
    for table in tables:
        published = comparable(table)
        implied = published and [implied_bias(published[k], true_EI) for k in LOCALS]
        ours = [row.EI[0].mean / true_EI - 1.0 for row in table.locals]
        dash = "solid" if table.snr_db is None else "dot"
        for whose, shares, colour in (
            ("paper", implied, colours.REFERENCE), ("here", ours, colours.MODEL),
        ):  # fmt: skip
            y, name = [100.0 * share for share in shares or ()], f"{whose}, {snr(table.snr_db)}"
            if y:
                traces.append(line(names, y, name, colour, "%{y:+.2f} %", dash=dash, **MARKED))
    text = (
        "Lines: bias of the mean EI. Bars: ± rms bias of noise-free fits over many draws of the "
        "excitation."
    )
    x = axis("working point θ₂", type="category")
    return figure(traces, x, axis("bias of EI [%]"), text, 420, barmode="overlay")


def bias_table(sources: Sequence[BiasSource], points: Sequence[float]) -> Table:
    """Root mean square bias of each source at each working point, and of the glocal fit."""
    titles = ("θ₂ wanders", *(angle(p) for p in points), "glocal")
    rows = []
    for s in sources:
        means = (*s.local.mean(axis=0), s.glocal.mean())
        cells = [
            f"{percent(float(rms), 2)} ({signed(float(mean)).removesuffix(' %')})"
            for rms, mean in zip((*s.rms, s.glocal_rms), means, strict=True)
        ]
        wander = f"{float(np.mean(s.wander)):.3f} rad"
        rows.append(Row((EXCITATIONS[s.excitation], RATES[s.rates], wander, *cells)))
    count = len(sources[0].local) if sources else 0
    text = (
        f"Root mean square over {count} draws of the excitation, the mean in brackets; no noise, "
        f"EI alone fitted."
    )
    columns = (*texts("Excitation", "ȳ computed with"), *numbers(*titles))
    return Table(columns, tuple(rows), text)


SHOWN = 15
"""Candidates in the table."""


def planning_figure(plan: Planning) -> Figure:
    """Expected deviation of the first target over theta2, a line per excitation."""
    by_name: dict[str, list[Candidate]] = {}
    for c in sorted(plan.candidates, key=lambda c: c.experiment.theta2):
        by_name.setdefault(c.experiment.name, []).append(c)
    lines = [
        line(
            [float(np.degrees(c.experiment.theta2)) for c in mine],
            [100.0 * c.expected[0].std for c in mine], name, colours.series(k),
            "%{x:.0f}°: %{y:.3f} %, bias %{customdata:+.3f} %",
            customdata=[100.0 * c.expected[0].bias for c in mine], **MARKED,
        )
        for k, (name, mine) in enumerate(sorted(by_name.items()))
    ]  # fmt: skip
    seconds = plan.candidates[0].experiment.seconds if plan.candidates else 0.0
    text = f"Of one experiment of {seconds:g} s with the noise of {plan.snr_db:g} dB data."
    y = axis(f"deviation of {plan.targets[0]} [%]", rangemode="tozero")
    return figure(lines, axis("working point θ₂ [°]"), y, text, 400)


def candidate_table(plan: Planning) -> Table:
    """The best candidates, and which of them make the best plan together."""
    titles = [title for name in plan.targets for title in (f"std of {name}", "bias")]
    columns = (*texts("Experiment"), *numbers("θ₂ [°]", "s", *titles), *texts("in the plan"))
    listed = [*plan.candidates[:SHOWN]]
    rows = []
    for c in (*listed, *(c for c in plan.chosen if c not in listed)):
        e, chosen = c.experiment, c in plan.chosen
        expected = [text for e in c.expected for text in (percent(e.std), signed(e.bias))]
        place = (e.name, f"{np.degrees(e.theta2):.0f}", f"{e.seconds:g}")
        rows.append(Row((*place, *expected, "yes" if chosen else ""), strong=chosen))
    text = (
        "Best first, by √(std² + bias²). The bias comes from the linear model on that motion; "
        "longer recordings do not reduce it."
    )
    return Table(columns, tuple(rows), text)


def length_table(plan: Planning) -> Table:
    """Length of each experiment against the deviation of the first target."""
    columns = numbers("s per experiment", f"std of {plan.targets[0]}, the study's experiments")
    rows = tuple(Row((f"{seconds:g}", percent(std))) for seconds, std in plan.lengths)
    return Table(columns, rows, "At the noise of the study's own noisy data.")


def predicted_table(plan: Planning) -> Table:
    """Fisher information against the Monte Carlo."""
    columns = (*texts("Fit", "quantity"), *numbers("predicted", "found", "found / predicted"))
    rows = tuple(
        Row((p.label, p.target, percent(p.predicted), percent(p.found), f"{p.ratio:.2f}"))
        for p in plan.predicted
    )
    return Table(columns, rows, "Relative standard deviation of EI.")
