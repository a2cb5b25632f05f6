"""An effect at work: measured, modelled without it and with it, and what it changes."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from markupsafe import Markup

from core.parameters import Parameter
from core.written import ShownUnit, shown_unit
from flexgui.views import colours
from flexgui.views.decimate import trace
from flexgui.views.layout import axis, frame
from flexgui.views.live import Figure, short
from flexgui.views.names import channel_symbol, output_title, typeset
from flexgui.views.numbers import format_number

POINTS = 600

PALE = colours.faded(colours.MEASURED, 0.45)
"""Measured lies below the line that is to meet it."""


class Shown(Protocol):
    """One output of one recording with and without an effect."""

    @property
    def title(self) -> str:
        """Of the effect."""

    @property
    def recording(self) -> str:
        """Name of the recording."""

    @property
    def channel(self) -> str:
        """The output that changes most."""

    @property
    def unit(self) -> str:
        """Of the channel."""

    @property
    def time(self) -> np.ndarray:
        """(N,) s"""

    @property
    def measured(self) -> np.ndarray:
        """(N,) in the unit; NaN where there is no sample."""

    @property
    def without(self) -> np.ndarray:
        """(N,) the model without the effect."""

    @property
    def with_it(self) -> np.ndarray:
        """(N,) the model with it."""

    @property
    def sizes(self) -> tuple[Parameter, ...]:
        """Its parameters at the values that were simulated."""


def demonstration(shown: Shown) -> Figure:
    """Two rows: the output; below it what the model without the effect leaves over, and what the
    effect changes."""
    layout: Figure = frame(300, "") | {"hovermode": "x unified"}
    layout["font"] = {**layout["font"], "size": 11}
    layout["xaxis"] = axis("time [s]") | {"anchor": "y2"}
    signal = shown_unit(shown.without, shown.unit)
    change, left = shown.with_it - shown.without, shown.measured - shown.without
    small = shown_unit(np.concatenate([change, left]), shown.unit)
    symbol = channel_symbol(shown.channel, shown.unit)
    layout["yaxis"] = axis(signal.label(symbol)) | {"domain": [0.52, 1.0], "anchor": "x"}
    layout["yaxis2"] = axis(small.label(f"Δ{symbol}")) | {"domain": [0.0, 0.46], "anchor": "x"}
    data = [
        _line(shown.time, shown.measured, "measured", PALE, 4.0, signal, ""),
        _line(shown.time, shown.without, "without it", colours.START, 1.4, signal, ""),
        _line(shown.time, shown.with_it, "with it", colours.ADDED, 1.6, signal, ""),
        _line(shown.time, left, "residual", colours.RESIDUAL, 1.0, small, "2"),
        _line(shown.time, change, "what it changes", colours.ADDED, 1.8, small, "2"),
    ]
    return {"data": data, "layout": layout}


def _line(
    x: np.ndarray, y: np.ndarray, name: str, colour: str, width: float, unit: ShownUnit,
    number: str,
) -> Figure:  # fmt: skip
    a, b = trace(x, y * unit.factor, POINTS)
    return {
        "type": "scatter", "mode": "lines", "x": short(a), "y": short(b), "name": name,
        "xaxis": "x", "yaxis": f"y{number}", "line": {"color": colour, "width": width},
        "hovertemplate": f"{name} %{{y:.4g}} {unit.name}<extra></extra>",
    }  # fmt: skip


def demonstration_summary(shown: Shown) -> Markup:
    """'With f_c1 = 1.2 N m: joint angle θ₁ in recording th3, where it changes most.'"""
    texts: list[Markup] = []
    for p in shown.sizes:
        unit = shown_unit(p.value, p.unit)
        number = f"{format_number(p.value * unit.factor, 3)} {unit.name}".strip()
        texts.append(Markup("{} = {}").format(typeset(p.symbol, p.name), number))
    size = Markup("With {}").format(Markup(", ").join(texts)) if texts else "With it"
    output = output_title(shown.channel, shown.unit)
    return Markup("{}: {} in recording {}, where it changes most.").format(
        size, output, shown.recording
    )
