"""Poles and modes of the arm, step responses and frequency responses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from flexgui.core.simulate.posture import Mode, integrators
from flexgui.core.simulate.response import FrequencyResponse, Port, StepResponse
from flexgui.sentences.written import (
    ShownUnit,
    channel_symbol,
    format_number,
    reference_symbol,
    shown_unit,
    split_name,
)
from flexgui.views import colours
from flexgui.views.layout import Figure, axis, dots, figure, line, note
from flexgui.views.names import TITLES
from flexgui.views.table import Row, Table, numbers, texts

OPACITY = 0.6
DOTS = 60
"""Per output, in turn: no two of them at one time."""

KEPT: Figure = {"uirevision": "keep", "hovermode": "x unified"}
"""A view that was zoomed stays so while a slider moves."""


def noisy_step(response: StepResponse, noise: np.ndarray) -> Figure:
    """Dots of the outputs with noise (N, ny, nr) under the lines of `step`."""
    drawn = step(response)
    if not np.any(noise):
        return drawn
    clock = shown_unit(response.time, "s").factor
    unit = shown_unit(response.values, response.outputs[0].unit).factor
    measured = (response.values + noise) * unit
    outputs = min(noise.shape[1:])
    rows = np.arange(0, len(measured), max(len(measured) // (DOTS * outputs), 1))
    own = np.arange(len(rows)) % outputs
    colour = colours.faded(colours.MEASURED, OPACITY)
    x, y = response.time[rows] * clock, measured[rows, own, own]
    under = dots(x, y, "with noise", colour, size=3) | {"hoverinfo": "skip"}
    return drawn | {"data": [under, *drawn["data"]]}


def step(response: StepResponse) -> Figure:
    """Each output over time in s (or ms), per unit of the stepped reference."""
    clock = shown_unit(response.time, "s")
    unit = shown_unit(response.values, response.outputs[0].unit)
    what = TITLES.get(split_name(response.outputs[0].name)[0], "output")
    return figure(
        pair_lines(
            response.time * clock.factor, response.values * unit.factor, response,
            f"%{{y:.4g}} {unit.name}",
        ),
        axis(clock.label("time"), range=[0.0, float(response.time[-1]) * clock.factor]),
        axis(f"{_outputs(response)} [{per_reference(unit, response.references)}]"),
        f"Unit step of each reference: {what}.", **KEPT,
    )  # fmt: skip


DECADES = 4.0
"""Shown below the largest gain; less than that nobody hears."""


def frequency_response(response: FrequencyResponse) -> Figure:
    """Magnitude over frequency in Hz, both logarithmic."""
    gain = np.abs(response.gain)
    unit = ShownUnit(1.0, response.outputs[0].unit or "–")
    top = float(np.log10(np.nanmax(gain, initial=1e-12) * 2.0))
    lowest = float(np.log10(max(gain[gain > 0.0].min(initial=1e12), 1e-12)))
    title = f"|{_outputs(response)}| [{per_reference(unit, response.references)}]"
    ends = [max(top - DECADES, lowest), top]
    return figure(
        pair_lines(response.frequency, gain, response, "%{y:.3g}"),
        _frequencies(response),
        axis(title, type="log", range=ends, dtick=1, exponentformat="power"),
        "Magnitude from each reference to each output.", **KEPT,
    )  # fmt: skip


def phase_response(response: FrequencyResponse) -> Figure:
    """Phase in degrees over frequency in Hz, unwrapped; a coupling of zero has no phase."""
    gain = response.gain
    size = np.nanmax(np.abs(gain), axis=0, initial=0.0)
    coupled = size > NEGLIGIBLE * size.max(initial=0.0)
    defined = np.isfinite(gain).all(axis=(1, 2))  # the curve goes on beyond a pole
    phase = np.full(gain.shape, np.nan)
    phase[defined] = np.rad2deg(np.unwrap(np.angle(gain[defined]), axis=0))
    phase = np.where(coupled, phase, 0.0)
    return figure(
        pair_lines(response.frequency, phase, response, "%{y:.0f}°"),
        _frequencies(response),
        axis(f"arg {_outputs(response)} [deg]", dtick=90),
        "Phase from each reference to each output.", **KEPT,
    )  # fmt: skip


def _frequencies(response: FrequencyResponse) -> Figure:
    ends = [float(np.log10(f)) for f in (response.frequency[0], response.frequency[-1])]
    return axis("frequency [Hz]", type="log", range=ends, dtick=1)


def _outputs(response: StepResponse | FrequencyResponse) -> str:
    return ", ".join(channel_symbol(port.name, port.unit) for port in response.outputs)


NEGLIGIBLE = 1e-9
"""Of the largest value: a coupling below is none and gets no line."""


def pair_lines(
    x: np.ndarray, values: np.ndarray, response: StepResponse | FrequencyResponse, hover: str
) -> list[Figure]:
    """Lines of values (N, ny, nr) over x (N,), one for each output and reference; NaN: a gap."""
    size = float(np.nanmax(np.abs(values), initial=0.0))
    lines = []
    for i, output in enumerate(response.outputs):
        for j, reference in enumerate(response.references):
            y = values[:, i, j]
            if float(np.nanmax(np.abs(y), initial=0.0)) <= NEGLIGIBLE * size:
                continue
            stepped = reference_symbol(reference.name, reference.unit)
            ends = (stepped, channel_symbol(output.name, output.unit))
            style = {"width": 1.8, "dash": colours.joint(j)["dash"]}
            lines.append(line(x, y, " → ".join(ends), colours.joint(i)["color"], hover, **style))
    return lines


def per_reference(unit: ShownUnit, references: Sequence[Port]) -> str:
    """'rad/s per rad/s' if all references share a unit, else only the output's unit."""
    units = {port.unit for port in references}
    return f"{unit.name} per {units.pop()}" if len(units) == 1 else unit.name


RATIOS = (0.1, 0.3, 0.7)
"""Lines of equal damping."""

INSIDE = 0.99
"""Of their way to the frame: a text that begins on the frame may not be drawn."""

POLE_MARGIN = 1.15
"""The axes reach this much further than the poles that swing."""

FAR = 3.0
"""A pole that only decays is out of the plot where it is this many times faster than the rest."""


def poles(values: np.ndarray, modes: Sequence[Mode] = (), clamped: Sequence[Mode] = ()) -> Figure:
    """The poles `values` (nx,) in 1/s; `clamped`: those with clamped joints, for comparison.

    Poles of pure decay far to the left are named in a note and not drawn: they would squeeze the
    others into a corner.
    """
    left, top, far = window(values)
    near = values[(values.real >= left) & (values.imag >= 0.0)]
    by_pole = {complex(m.pole): m for m in modes}
    shown = [m for m in clamped if m.pole.real >= left]
    traces = _damping_lines(left, top)
    if shown:
        labels = [_pole_label(m, m.pole) for m in shown]
        style: Figure = {"symbol": "circle-open", "size": 9}
        values = np.array([m.pole for m in shown])
        traces.append(_marks(values, "joints clamped", colours.START, labels, "clamped: ", **style))
    labels = [_pole_label(by_pole.get(complex(s)), s) for s in near]
    cross: Figure = {"symbol": "x-thin", "size": 10, "line": {"width": 2.2, "color": colours.MODEL}}
    traces.append(_marks(near, "drive closed", colours.MODEL, labels, **cross))
    several = ", ".join(format_number(s, 3) for s in sorted(far.real, reverse=True))
    notes = [note(f"◂ also at {several} 1/s", 0.0, 1.0, yanchor="top")] if far.size else []
    return figure(
        traces,
        axis("Re s [1/s]", range=[left, -0.12 * left], zeroline=True, zerolinecolor=colours.AXIS),
        axis("Im s [rad/s]", range=[-0.05 * top, top]),
        "Cross: pole with the drive closed. Circle: with the joints clamped. The lower half-plane "
        "is a mirror image.",
        annotations=notes, **(KEPT | {"hovermode": "closest"}),
    )  # fmt: skip


def window(values: np.ndarray) -> tuple[float, float, np.ndarray]:
    """(left end, upper end, poles outside) of a plot of `values` (nx,), in 1/s."""
    swinging = values[np.abs(values.imag) > 1e-6 * np.abs(values)]
    core = swinging if swinging.size else values[~integrators(values)]
    if not core.size:
        return -1.0, 1.0, values[:0]
    width = float(np.abs(core.real).max())
    top = float(np.abs(core.imag).max())
    reach = max(width, 0.05 * top)
    decaying = values[(np.abs(values.imag) <= 1e-6 * np.abs(values)) & (values.real < 0.0)]
    inside = decaying[np.abs(decaying.real) <= FAR * reach]
    left = POLE_MARGIN * max(reach, float(np.abs(inside.real).max(initial=0.0)))
    return -left, POLE_MARGIN * (top if top > 0.0 else left), decaying[np.abs(decaying.real) > left]


def _marks(
    values: np.ndarray, name: str, colour: str, labels: list[str], before: str = "", **marker: Any
) -> Figure:
    hover = f"{before}%{{text}}<extra></extra>"
    return dots(values.real, values.imag, name, colour, hover, **marker) | {"text": labels}


def _pole_label(mode: Mode | None, s: complex) -> str:
    if mode is None:
        return f"s = {format_number(s.real)} 1/s"
    return f"{format_number(mode.frequency)} Hz, damping {format_number(mode.damping, 3)}"


def _damping_lines(left: float, top: float) -> list[Figure]:
    """Rays of equal damping ratio zeta, as one line with gaps because each trace costs time."""
    slopes = np.array([np.sqrt(1.0 - ratio**2) / ratio for ratio in RATIOS])
    x = INSIDE * np.maximum(left, -top / slopes)
    y = -slopes * x
    quiet: Figure = {"hoverinfo": "skip", "showlegend": False}
    along, up = ([part for end in ends for part in (end, 0.0, None)] for ends in (x, y))
    rays = line(along, up, "", colours.GRID, width=1, dash="dot", **quiet)
    names = {
        "type": "scatter", "mode": "text", "x": x, "y": y, **quiet,
        "text": [f"ζ = {ratio:g}" for ratio in RATIOS], "textposition": "bottom right",
        "textfont": {"size": 10, "color": colours.TEXT},
    }  # fmt: skip
    return [rays, names]


UNDAMPED = 5e-7
"""A damping ratio below is rounding."""


def mode_table(modes: Sequence[Mode]) -> Table:
    """One row per vibration, lowest frequency first."""
    columns = (*texts("Mode"), *numbers("Damped frequency [Hz]", "Damping ratio [–]"))
    rows = (
        Row((f"{k}", format_number(m.frequency), _damping(m))) for k, m in enumerate(modes, start=1)
    )
    return Table(columns, tuple(rows))


def _damping(mode: Mode) -> str:
    return "0" if abs(mode.damping) < UNDAMPED else format_number(mode.damping, 3)
