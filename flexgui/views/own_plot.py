"""A plot of chosen signals: measured, modelled and residual outputs, and columns of a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexgui.core.recording.channels import channel_kind
from flexgui.core.recording.recording import Recording
from flexgui.core.results import RecordingComparison
from flexgui.sentences.written import channel_symbol, reference_symbol, shown_unit
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, line, panes, trace
from flexgui.views.sketch import PANEL_POINTS

PARTS = {"measured": "solid", "model": "dash", "residual": "dot"}
"""What there is of an output, and its dash."""


@dataclass(frozen=True)
class Signal:
    """One signal that can be drawn."""

    key: str
    """'theta1/model', or the name of a recording's column."""
    title: str
    unit: str
    """SI"""
    time: np.ndarray
    """(N,) s"""
    values: np.ndarray
    """(N,); NaN where there is no sample"""
    dash: str = "solid"


def signals_of(
    compared: RecordingComparison | None, recording: Recording | None
) -> dict[str, Signal]:
    """All that can be drawn of one recording, by key: outputs first, then other columns."""
    found: dict[str, Signal] = {}
    for c in () if compared is None else compared.channels:
        symbol = channel_symbol(c.channel, c.unit)
        parts = {"measured": c.measured, "model": c.model, "residual": c.residual}
        for part, dash in PARTS.items():
            key = f"{c.channel}/{part}"
            found[key] = Signal(key, f"{symbol} {part}", c.unit, c.time, parts[part], dash)
    if recording is None:
        return found
    outputs = {c.channel for c in compared.channels} if compared is not None else set()
    for name in (name for name in recording.channels if name not in outputs):
        unit = channel_kind(name).units[0]
        title = reference_symbol(name, unit)
        found[name] = Signal(name, title, unit, recording.time, recording[name])
    return found


def own_plot(signals: Mapping[str, Signal], chosen: Sequence[str]) -> Figure | None:
    """The chosen signals over time in s, a pane for each unit; None without any."""
    drawn = [signals[key] for key in chosen if key in signals]
    parts = []
    for si in dict.fromkeys(signal.unit for signal in drawn):
        alike = [signal for signal in drawn if signal.unit == si]
        unit = shown_unit(np.concatenate([s.values for s in alike]), si)
        lines = []
        for signal in alike:
            x, y = trace(signal.time, signal.values * unit.factor, PANEL_POINTS)
            hover = f"{signal.title} %{{y:.4g}} {unit.name}<extra></extra>"
            colour = colours.series(drawn.index(signal))
            lines.append(line(x, y, signal.title, colour, hover, width=1.3, dash=signal.dash))
        parts.append(Pane(lines, axis(f"[{unit.name or '–'}]")))
    return panes(parts, axis("time [s]"), gap=0.06, hovermode="x unified") if parts else None
