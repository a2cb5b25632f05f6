"""What the arm answers to each reference: to a unit step, and over frequency."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from core.simulate.response import FrequencyResponse, Port, StepResponse
from core.written import ShownUnit, shown_unit, split_name
from flexgui.views import colours
from flexgui.views.layout import Figure, dots, small_axis, small_figure
from flexgui.views.names import TITLES, channel_symbol

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


DECADES = 4.0
"""Shown below the largest gain; less than that nobody hears."""


def frequency_response(response: FrequencyResponse) -> Figure:
    """Magnitude over frequency in Hz, both logarithmic."""
    gain = np.abs(response.gain)
    symbol = ", ".join(channel_symbol(port.name, port.unit) for port in response.outputs)
    unit = ShownUnit(1.0, response.outputs[0].unit or "–")
    top = float(np.log10(gain.max(initial=1e-12) * 2.0))
    least = float(np.log10(max(gain[gain > 0.0].min(initial=1e12), 1e-12)))
    traces = pair_lines(response.frequency, gain, response.outputs, response.references, "%{y:.3g}")
    return small_figure(
        traces,
        _frequencies(response),
        small_axis(
            f"|{symbol}| [{per_reference(unit, response.references)}]",
            type="log",
            range=[max(top - DECADES, least), top],
            dtick=1,
            exponentformat="power",
        ),
        "Magnitude of the response from each reference to each output.",
        hovermode="x unified",
    )


def phase_response(response: FrequencyResponse) -> Figure:
    """Phase in degrees over frequency in Hz, without jumps of 360°; a coupling that is none (see
    `pair_lines`) has no phase."""
    gain = response.gain
    coupled = np.abs(gain).max(axis=0) > NEGLIGIBLE * np.abs(gain).max(initial=0.0)
    phase = np.where(coupled, np.rad2deg(np.unwrap(np.angle(gain), axis=0)), 0.0)
    traces = pair_lines(
        response.frequency, phase, response.outputs, response.references, "%{y:.0f}°"
    )
    symbol = ", ".join(channel_symbol(port.name, port.unit) for port in response.outputs)
    return small_figure(
        traces,
        _frequencies(response),
        small_axis(f"arg {symbol} [deg]", dtick=90),
        "Phase of the response from each reference to each output.",
        hovermode="x unified",
    )


def _frequencies(response: FrequencyResponse) -> Figure:
    ends = [float(np.log10(f)) for f in (response.frequency[0], response.frequency[-1])]
    return small_axis("frequency [Hz]", type="log", range=ends, dtick=1)


DASHES = ("solid", "dash", "dot")
NEGLIGIBLE = 1e-9
"""Of the largest value: a coupling below is none and gets no line."""


def reference_symbol(port: Port) -> str:
    """'dtheta1_ref' -> 'θ̇₁*'."""
    return channel_symbol(port.name.removesuffix("_ref"), port.unit) + (
        "*" if port.name.endswith("_ref") else ""
    )


def pair_lines(
    x: np.ndarray,
    values: np.ndarray,
    outputs: Sequence[Port],
    references: Sequence[Port],
    hover: str,
) -> list[dict[str, Any]]:
    """Traces of values (N, ny, nr) over x (N,)."""
    size = float(np.abs(values).max(initial=0.0))
    return [
        {
            "type": "scatter",
            "x": x,
            "y": np.ascontiguousarray(values[:, i, j], dtype=np.float32),
            "mode": "lines",
            "name": f"{reference_symbol(reference)} → {channel_symbol(output.name, output.unit)}",
            "line": {
                "color": colours.joint(i)["color"],
                "width": 1.8,
                "dash": DASHES[j % len(DASHES)],
            },
            "hovertemplate": hover,
        }
        for i, output, j, reference in _pairs(outputs, references)
        if float(np.abs(values[:, i, j]).max(initial=0.0)) > NEGLIGIBLE * size
    ]


def _pairs(
    outputs: Sequence[Port], references: Sequence[Port]
) -> Iterator[tuple[int, Port, int, Port]]:
    for i, output in enumerate(outputs):
        for j, reference in enumerate(references):
            yield i, output, j, reference


def per_reference(unit: ShownUnit, references: Sequence[Port]) -> str:
    """'rad/s per rad/s' where all references share a unit, else only the output's."""
    units = {port.unit for port in references}
    return f"{unit.name} per {units.pop()}" if len(units) == 1 else unit.name
