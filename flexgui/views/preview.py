"""What a recording holds: one row of the figure per kind of channel, with units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from core.recording.channels import channel_kind, joint_of
from core.recording.recording import Recording
from flexgui.views import colours
from flexgui.views.decimate import trace
from flexgui.views.layout import axis, frame
from flexgui.views.live import Figure, short
from flexgui.views.names import channel_symbol
from flexgui.views.units import shown_unit

POINTS = 600
"""A panel is about as many pixels wide."""
ROWS = 5
"""More kinds than these do not fit beside the arm; the first ones are shown."""
ORDER = ("dtheta#_ref", "theta#_ref", "i#_ref", "u#", "i#", "theta#", "z#", "deflection#", "ydot#")
LAST = ("y#",)
"""Follow from others in most recordings."""
MEASURED_LINES = (colours.MEASURED, colours.ADDED, "#a06cd5")


def preview(recording: Recording, slides: Sequence[bool] = ()) -> Figure:
    """References and measurements over time in s; stretches that do not count are grey.

    `slides` tells for each joint whether it slides: its positions are in m then.
    """
    kinds = _kinds(recording)
    layout = frame(700, "") | {"xaxis": axis("time [s]") | {"anchor": f"y{len(kinds)}"}}
    layout["font"] = {**layout["font"], "size": 11}
    layout["hovermode"] = "x unified"
    layout["legend"] = {**layout["legend"], "x": 1.0, "xanchor": "right"}
    room, gap = 1.0 / max(len(kinds), 1), 0.05
    data: list[Figure] = []
    for row, names in enumerate(kinds):
        values = np.concatenate([recording[name] for name in names])
        unit = shown_unit(values, _unit(names[0], slides))
        number = "" if row == 0 else str(row + 1)
        top = 1.0 - row * room
        label = unit.label(", ".join(_symbol(name) for name in names))
        layout[f"yaxis{number}"] = axis(label) | {
            "anchor": "x", "domain": [max(top - room + gap, 0.0), top],
        }  # fmt: skip
        data += [_line(recording, n, k, unit.factor, number) for k, n in enumerate(names)]
    layout["shapes"] = masked(recording, kinds)
    return {"data": data, "layout": layout}


def _kinds(recording: Recording) -> list[list[str]]:
    found: dict[str, list[str]] = {}
    for name in sorted(recording.channels):
        found.setdefault(channel_kind(name).pattern, []).append(name)
    known = [p for p in ORDER if p in found]
    rest = [p for p in found if p not in (*ORDER, *LAST)]
    last = [p for p in LAST if p in found]
    return [found[p] for p in (*known, *rest, *last)][:ROWS]


def _unit(name: str, slides: Sequence[bool]) -> str:
    """The first of a channel's units belongs to joints that turn, the second to slides."""
    units, joint = channel_kind(name).units, joint_of(name)
    sliding = joint is not None and joint < len(slides) and slides[joint]
    return units[-1] if sliding else units[0]


def _symbol(name: str) -> str:
    """'dtheta1_ref' -> 'θ̇₁*'."""
    return channel_symbol(name.removesuffix("_ref")) + ("*" if name.endswith("_ref") else "")


def _line(recording: Recording, name: str, k: int, factor: float, number: str) -> Figure:
    x, y = trace(recording.time, recording[name] * factor, POINTS)
    reference = name.endswith("_ref")
    colour = colours.START if reference and k == 0 else MEASURED_LINES[k % len(MEASURED_LINES)]
    return {
        "type": "scatter", "mode": "lines", "x": short(x), "y": short(y),
        "name": _symbol(name), "xaxis": "x", "yaxis": f"y{number}", "showlegend": False,
        "line": {"color": colour, "width": 1.2},
        "hovertemplate": f"{_symbol(name)} %{{y:.4g}}<extra></extra>",
    }  # fmt: skip


def masked(recording: Recording, kinds: Sequence[Sequence[str]]) -> list[dict[str, Any]]:
    """Grey bands over the stretches of a channel that the user masked."""
    shapes = []
    for row, names in enumerate(kinds):
        number = "" if row == 0 else str(row + 1)
        for name in names:
            counted = recording.counted.get(name)
            if counted is None:
                continue
            edges = np.flatnonzero(np.diff(np.concatenate([[1], counted.astype(int), [1]])))
            for start, stop in edges.reshape(-1, 2):
                shapes.append(
                    {
                        "type": "rect", "xref": "x", "yref": f"y{number} domain", "y0": 0, "y1": 1,
                        "x0": float(recording.time[start]), "x1": float(recording.time[stop - 1]),
                        "fillcolor": colours.faded(colours.START, 0.35), "line": {"width": 0},
                    }
                )  # fmt: skip
    return shapes


def cursor_shape(time: float) -> dict[str, Any]:
    """The time-line's cursor in any figure whose first axis is time in s."""
    return {
        "type": "line", "xref": "x", "yref": "paper", "x0": time, "x1": time, "y0": 0, "y1": 1,
        "line": {"color": colours.START, "width": 1.5, "dash": "dot"},
    }  # fmt: skip
