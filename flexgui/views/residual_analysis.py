"""Correlations of the residuals in their bands, and measured beside modelled frequency response."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexgui.core.residual_analysis import MeasuredResponse, ResidualAnalysis, ResidualCorrelation
from flexgui.sentences.written import channel_symbol, reference_symbol, shown_unit
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, band, dots, line, panes

RESIDUAL_ROW, AROUND_ROWS = 110, 100
"""px of a row, and of what surrounds all of them."""
FOLLOWS = 0.5
"""Coherence from which a response is drawn: more of the output follows the inputs than not."""


def correlations(found: ResidualAnalysis, recording: str) -> Figure | None:
    """A row per output: its correlations in multiples of their bands; None without any."""
    shown = [c for c in found.correlations if c.recording == recording]
    rows = [_of_channel(shown, name) for name in dict.fromkeys(c.channel for c in shown)]
    if not rows:
        return None
    clock = shown_unit(max(c.lag[-1] for c in shown), "s")
    parts = [_row(row, clock.factor, clock.name) for row in rows]
    caption = (
        f"Correlation of each residual with itself and with the inputs, over its "
        f"{100.0 * found.level:g} % band (shaded): inside nothing is left to explain."
    )
    height = AROUND_ROWS + RESIDUAL_ROW * len(rows)
    return panes(parts, axis(clock.label("lag")), caption, height, gap=0.12 / len(rows))


def _of_channel(shown: Sequence[ResidualCorrelation], name: str) -> list[ResidualCorrelation]:
    return [c for c in shown if c.channel == name]


def _row(row: Sequence[ResidualCorrelation], factor: float, unit: str) -> Pane:
    traces = []
    for k, c in enumerate(row):
        ratio = c.value / c.band
        name = f"with {reference_symbol(c.input)}" if c.input else "with itself"
        hover = f"{name} %{{y:.3g}} × band at %{{x:.4g}} {unit}<extra></extra>"
        traces.append(line(c.lag * factor, ratio, name, colours.series(k), hover, width=1.4))
    ratios = np.concatenate([c.value / c.band for c in row])
    ends = [min(-1.5, 1.1 * float(ratios.min())), max(1.5, 1.1 * float(ratios.max()))]
    lag, one = np.array([0.0, row[0].lag[-1] * factor]), np.ones(2)
    inside = band((lag, one), (lag, -one), "band", colours.FLOOR)
    symbol = channel_symbol(row[0].channel)
    return Pane([inside, *traces], axis(f"Δ{symbol}", range=ends, nticks=5))


def responses(found: ResidualAnalysis, recording: str) -> Figure | None:
    """A row per output: magnitudes from each input over Hz; None without any."""
    shown = [r for r in found.responses if r.recording == recording]
    kept = [r for r in shown if (r.coherence > FOLLOWS).any()]
    names = list(dict.fromkeys(r.channel for r in kept))
    if not names:
        return None
    inputs = list(dict.fromkeys(r.input for r in kept))
    ends = [np.log10(f) for f in (kept[0].frequency[0], kept[0].frequency[-1])]
    parts = [_magnitudes([r for r in kept if r.channel == name], inputs) for name in names]
    caption = (
        "Magnitude from each input to each output where most of the output follows the inputs: as "
        "measured (dots), and of the modelled output by the same estimate (lines)."
    )
    x = axis("frequency [Hz]", type="log", range=ends, dtick=1)
    return panes(parts, x, caption, AROUND_ROWS + RESIDUAL_ROW * len(parts), gap=0.12 / len(parts))


SYMBOLS = ("circle", "x", "diamond")
"""Of the inputs."""


def _magnitudes(row: Sequence[MeasuredResponse], inputs: Sequence[str]) -> Pane:
    traces = []
    for r in row:
        k = inputs.index(r.input)
        sure, name = r.coherence > FOLLOWS, reference_symbol(r.input, r.input_unit)
        hover = f"{name} %{{y:.3g}} at %{{x:.3g}} Hz"
        measured, model = (np.where(sure, np.abs(g), np.nan) for g in (r.measured, r.model))
        dash = colours.JOINT_DASHES[k % len(colours.JOINT_DASHES)]
        mark = {"size": 4, "symbol": SYMBOLS[k % len(SYMBOLS)]}
        traces += [
            dots(r.frequency, measured, f"measured, {name}", colours.MEASURED, hover, **mark),
            line(r.frequency, model, f"model, {name}", colours.MODEL, hover, dash=dash),
        ]
    title = f"|{channel_symbol(row[0].channel, row[0].unit)}|"
    return Pane(traces, axis(title, type="log", dtick=1, exponentformat="power"))
