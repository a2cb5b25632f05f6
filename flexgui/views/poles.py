"""Poles and modes of the arm: where they lie, how fast and how damped they are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from core.simulate.modes import Mode, integrators
from core.written import format_number
from flexgui.views import colours
from flexgui.views.layout import Figure, small_axis, small_figure
from flexgui.views.table import Column, Row, Table

RATIOS = (0.1, 0.3, 0.7)
"""Lines of equal damping."""

INSIDE = 0.99
"""Of their way to the frame: a text that begins on the frame may not be drawn."""

ROOM = 1.15
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
    left = ROOM * max(reach, float(np.abs(inside.real).max(initial=0.0)))
    return -left, ROOM * (top if top > 0.0 else left), decaying[np.abs(decaying.real) > left]


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
        Column("Frequency [Hz]", numeric=True),
        Column("Damping ratio [–]", numeric=True),
    )
    rows = (Row((f"{k + 1}", format_number(m.frequency), damping(m))) for k, m in enumerate(modes))
    return Table(columns, tuple(rows))


def damping(mode: Mode) -> str:
    """The damping ratio as text."""
    return "0" if abs(mode.damping) < UNDAMPED else format_number(mode.damping, 3)
