"""Poles and modes of the arm, and what it answers to each reference: to a unit step and over
frequency."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from flexgui.core.simulate.posture import Mode, integrators
from flexgui.core.simulate.response import FrequencyResponse, Port, StepResponse
from flexgui.sentences.written import ShownUnit, format_number, shown_unit, split_name
from flexgui.views import colours
from flexgui.views.layout import Figure, dots, small_axis, small_figure
from flexgui.views.names import TITLES, channel_symbol
from flexgui.views.table import Column, Row, Table

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


RATIOS = (0.1, 0.3, 0.7)
"""Lines of equal damping."""

INSIDE = 0.99
"""Of their way to the frame: a text that begins on the frame may not be drawn."""

MARGIN = 1.15
"""The axes reach this much further than the poles that swing."""

FAR = 3.0
"""A pole that only decays is out of the plot where it is this many times faster than the rest."""

REAL, IMAGINARY = "Re s [1/s]", "Im s [rad/s]"


def poles(values: np.ndarray, modes: Sequence[Mode] = (), clamped: Sequence[Mode] = ()) -> Figure:
    """The poles (nx,) in 1/s; `clamped` are those of the arm with its joints held, for comparison.

    Poles of pure decay far to the left are named in a note and not drawn: they would squeeze the
    others into a corner.
    """
    left, top, far = window(values)
    near = values[(values.real >= left) & (values.imag >= 0.0)]
    traces = [*_damping_lines(left, top), _clamped(clamped, left), _points(near, modes)]
    notes = [_note(far)] if far.size else []
    return small_figure(
        [t for t in traces if t is not None],
        small_axis(REAL, range=[left, -0.12 * left], zeroline=True, zerolinecolor=colours.AXIS),
        small_axis(IMAGINARY, range=[-0.05 * top, top]),
        "Cross: a pole with the drive closed. Circle: with the joints clamped. The lower half of "
        "the plane mirrors this one.",
        hovermode="closest",
        annotations=notes,
    )


def window(values: np.ndarray) -> tuple[float, float, np.ndarray]:
    """(left end, upper end, poles that are left out) of a plot in 1/s."""
    swinging = values[np.abs(values.imag) > 1e-6 * np.abs(values)]
    core = swinging if swinging.size else values[~integrators(values)]
    if not core.size:
        return -1.0, 1.0, values[:0]
    width = float(np.abs(core.real).max())
    top = float(np.abs(core.imag).max())
    reach = max(width, 0.05 * top)
    decaying = values[(np.abs(values.imag) <= 1e-6 * np.abs(values)) & (values.real < 0.0)]
    inside = decaying[np.abs(decaying.real) <= FAR * reach]
    left = MARGIN * max(reach, float(np.abs(inside.real).max(initial=0.0)))
    return -left, MARGIN * (top if top > 0.0 else left), decaying[np.abs(decaying.real) > left]


def _points(near: np.ndarray, modes: Sequence[Mode]) -> dict[str, Any]:
    by_pole = {complex(m.pole): m for m in modes}
    return {
        "type": "scatter",
        "x": near.real,
        "y": near.imag,
        "mode": "markers",
        "name": "drive closed",
        "marker": {
            "symbol": "x-thin",
            "size": 10,
            "line": {"width": 2.2, "color": colours.MODEL},
        },
        "text": [_pole_label(by_pole.get(complex(s)), s) for s in near],
        "hovertemplate": "%{text}<extra></extra>",
    }


def _pole_label(mode: Mode | None, s: complex) -> str:
    if mode is None:
        return f"s = {format_number(s.real)} 1/s"
    return f"{format_number(mode.frequency)} Hz, damping {format_number(mode.damping, 3)}"


def _clamped(modes: Sequence[Mode], left: float) -> dict[str, Any] | None:
    near = [m for m in modes if m.pole.real >= left]
    if not near:
        return None
    return {
        "type": "scatter",
        "x": [m.pole.real for m in near],
        "y": [m.pole.imag for m in near],
        "mode": "markers",
        "name": "joints clamped",
        "marker": {"symbol": "circle-open", "size": 9, "color": colours.START},
        "text": [_pole_label(m, m.pole) for m in near],
        "hovertemplate": "clamped: %{text}<extra></extra>",
    }


def _damping_lines(left: float, top: float) -> list[dict[str, Any]]:
    """Rays of equal damping ratio zeta: Re s = -zeta |s|, up to the frame of the plot, as one line
    with gaps and their names: each trace more costs the browser time."""
    slopes = np.array([np.sqrt(1.0 - ratio**2) / ratio for ratio in RATIOS])
    x = INSIDE * np.maximum(left, -top / slopes)
    y = -slopes * x
    unnamed = {"type": "scatter", "hoverinfo": "skip", "showlegend": False}
    rays = {
        "x": [part for end in x for part in (end, 0.0, None)],
        "y": [part for end in y for part in (end, 0.0, None)],
        "mode": "lines",
        "line": {"color": colours.GRID, "width": 1, "dash": "dot"},
    }
    names = {
        "x": x,
        "y": y,
        "mode": "text",
        "text": [f"ζ = {ratio:g}" for ratio in RATIOS],
        "textposition": "bottom right",
        "textfont": {"size": 10, "color": colours.TEXT},
    }
    return [unnamed | rays, unnamed | names]


def _note(far: np.ndarray) -> dict[str, Any]:
    several = ", ".join(format_number(s, 3) for s in sorted(far.real, reverse=True))
    return {
        "text": f"◂ also at {several} 1/s",
        "xref": "paper",
        "yref": "paper",
        "x": 0.0,
        "y": 1.0,
        "xanchor": "left",
        "yanchor": "top",
        "showarrow": False,
        "font": {"size": 11, "color": colours.TEXT},
    }


UNDAMPED = 5e-7
"""A damping ratio below is rounding."""


def mode_table(modes: Sequence[Mode]) -> Table:
    """One row per vibration, slowest first."""
    columns = (
        Column("Mode"),
        Column("Damped frequency [Hz]", numeric=True),
        Column("Damping ratio [–]", numeric=True),
    )
    rows = (Row((f"{k + 1}", format_number(m.frequency), damping(m))) for k, m in enumerate(modes))
    return Table(columns, tuple(rows))


def damping(mode: Mode) -> str:
    """The damping ratio as text."""
    return "0" if abs(mode.damping) < UNDAMPED else format_number(mode.damping, 3)
