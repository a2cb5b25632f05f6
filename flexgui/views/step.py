"""Step response: what the arm does after a unit step of each reference."""

from __future__ import annotations

import numpy as np

from core.simulate.response import StepResponse
from core.written import shown_unit, split_name
from flexgui.views import colours
from flexgui.views.live import Figure, dots
from flexgui.views.names import TITLES, channel_symbol
from flexgui.views.pairs import pair_lines, per_reference
from flexgui.views.small import small_axis, small_figure

OPACITY = 0.6
DOTS = 60
"""Per output, in turn: no two of them at one time."""


def noisy_step(response: StepResponse, noise: np.ndarray) -> Figure:
    """Dots of the outputs with noise (N, ny, nr) under the lines of `step`."""
    figure = step(response)
    if not np.any(noise):
        return figure
    clock = shown_unit(response.time, "s").factor
    unit = shown_unit(response.values, response.outputs[0].unit).factor
    measured = (response.values + noise) * unit
    outputs = min(noise.shape[1:])
    rows = np.arange(0, len(measured), max(len(measured) // (DOTS * outputs), 1))
    own = np.arange(len(rows)) % outputs
    colour = colours.faded(colours.MEASURED, OPACITY)
    x, y = response.time[rows] * clock, measured[rows, own, own]
    under = dots(x, y, "with noise", colour, size=3) | {"hoverinfo": "skip"}
    return figure | {"data": [under, *figure["data"]]}


def step(response: StepResponse) -> Figure:
    """Each output over time in s (or ms), per unit of the stepped reference."""
    clock = shown_unit(response.time, "s")
    unit = shown_unit(response.values, response.outputs[0].unit)
    symbol = ", ".join(channel_symbol(port.name, port.unit) for port in response.outputs)
    traces = pair_lines(
        response.time * clock.factor, response.values * unit.factor,
        response.outputs, response.references, f"%{{y:.4g}} {unit.name}",
    )  # fmt: skip
    name = f"{symbol} [{per_reference(unit, response.references)}]"
    what = TITLES.get(split_name(response.outputs[0].name)[0], "output")
    return small_figure(
        traces,
        small_axis(clock.label("time"), range=[0.0, float(response.time[-1]) * clock.factor]),
        small_axis(name),
        f"Unit step of each reference; shown is the {what}.",
        hovermode="x unified",
    )
