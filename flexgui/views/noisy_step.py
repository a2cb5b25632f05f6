"""The step response with what a measurement of it would look like."""

from __future__ import annotations

import numpy as np

from core.simulate.response import StepResponse
from flexgui.views import colours
from flexgui.views.live import Figure, dots
from flexgui.views.step import step
from flexgui.views.units import shown_unit

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
