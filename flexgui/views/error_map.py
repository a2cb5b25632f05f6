"""Where the model fails: over working points and frequency or time, and at this moment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from flexgui.core.recording.channels import DRIVES, Role, role_of
from flexgui.core.results import ChannelComparison, ErrorMap, RecordingComparison, WorstCell
from flexgui.sentences.written import channel_symbol, format_number, quantity
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, heat, named_axis, number, panes
from flexgui.views.table import Row, Table, numbers, texts

LEAST_SPAN = 10.0
"""Times the floor that the colours span at least: an error at the floor should look pale."""

TICKS = (1, 3, 10, 30, 100, 300, 1000, 10_000, 100_000)

LEAST_HEIGHT = 200
"""Of a figure: the colours need room for their numbers."""

HEIGHT_OF_FRAME, HEIGHT_PER_ROW, GAP = 130, 22, 62


def error_map(
    maps: Sequence[ErrorMap], narrow: bool = False, chosen: WorstCell | None = None,
    dark: bool = False,
) -> Figure | None:  # fmt: skip
    """One heat map per channel on a common colour scale; None without maps.

    `narrow`: of each band only the beginning is written; `chosen` is outlined; `dark`: for a dark
    page.
    """
    shown = [m for m in maps if np.isfinite(m.ratio).any()]
    if not shown:
        return None
    top = max(LEAST_SPAN, max(float(np.nanmax(m.ratio)) for m in shown))
    last = shown[-1]
    parts, outlines = [], list[Figure]()
    for k, m in enumerate(shown):
        x = _axis_over(m, narrow, m is last) | ({"matches": "x"} if k and m.axis == "time" else {})
        rows = named_axis(row_labels(m), autorange="reversed", automargin=True)
        name = f"error of {channel_symbol(m.channel, m.unit)}"
        share = HEIGHT_PER_ROW * len(m.recordings)
        parts.append(Pane([_heat(m, top, m is shown[0], dark)], rows, x, share, name))
        outlines += _outline(m, chosen, number(k))
    height = HEIGHT_OF_FRAME + sum(p.share for p in parts) + GAP * (len(parts) - 1)
    height = int(max(height, LEAST_HEIGHT))
    gap = min(GAP / (height - HEIGHT_OF_FRAME + GAP), 0.9 / max(len(parts) - 1, 1))
    text = (
        "Rms error in multiples of the noise floor. Pale: at the noise floor. Dark: the model "
        "fails. Empty: no samples."
    )
    drawn = panes(parts, None, text, height, gap, shapes=outlines)
    if last.axis == "time":
        drawn["layout"]["meta"] |= {"columns": last.edges.tolist()}
    return drawn


def _axis_over(m: ErrorMap, narrow: bool, named: bool) -> Figure:
    """Axis of time in s, or of frequency bands at 0, 1, 2, …"""
    title = "frequency band" if m.axis == "frequency" else "time since the start"
    text = f"{title} [{m.axis_unit}]" if named else ""
    if m.axis == "time":
        return axis(text)
    cells = [label.split("–")[0] if narrow else label for label in cell_labels(m.edges)]
    return named_axis(cells, text, tickangle=0)


def _outline(m: ErrorMap, cell: WorstCell | None, axes: str) -> list[Figure]:
    """A frame around the chosen cell, if it is in this map."""
    if cell is None or (m.channel, m.axis) != (cell.channel, cell.axis):
        return []
    row = m.recordings.index(cell.recording)
    column = int(np.flatnonzero(m.edges == cell.low)[0])
    ends = (cell.low, cell.high) if m.axis == "time" else (column - 0.5, column + 0.5)
    return [
        {
            "type": "rect", "xref": f"x{axes}", "yref": f"y{axes}", "x0": ends[0], "x1": ends[1],
            "y0": row - 0.5, "y1": row + 0.5, "line": {"color": colours.MEASURED, "width": 3},
        }
    ]  # fmt: skip


def _heat(m: ErrorMap, top: float, legend: bool, dark: bool) -> Figure:
    ticks = [t for t in TICKS if t <= top * 1.01]
    named = {"tickvals": [float(np.log10(t)) for t in ticks], "ticktext": [str(t) for t in ticks]}
    scale = colours.RISING_ON_DARK if dark else colours.RISING
    place = {"x": m.edges} if m.axis == "time" else {}
    return heat(
        np.log10(np.maximum(m.ratio, 1e-3)), scale, "× noise floor", **place,
        zmin=0.0, zmax=float(np.log10(top)), showscale=legend, colorbar={**named, "len": 1.0},
        xgap=1, ygap=1, meta={"cells": [m.axis, m.channel]},
        customdata=np.stack([m.ratio, m.rms], axis=-1), text=_numbers(m.ratio),
        texttemplate="%{text}",
        hovertemplate="%{customdata[0]:.3g} times the noise floor, rms %{customdata[1]:.3g} "
        f"{m.unit or '–'}<extra></extra>",
    )  # fmt: skip


def _numbers(ratio: np.ndarray) -> list[list[str]]:
    """What is written in the cells (rows, columns), where there is room."""
    return [[format_number(float(r), 2) if np.isfinite(r) else "" for r in row] for row in ratio]


def row_labels(m: ErrorMap) -> list[str]:
    """The recording's name, with its working point if the name does not state it."""
    return [
        name
        if point is None or any(word in name.lower() for word in ("theta2", "θ2", "θ₂"))
        else f"{name} (θ₂ {np.degrees(point):.0f}°)"
        for name, point in zip(m.recordings, m.theta2, strict=True)
    ]


def cell_labels(edges: np.ndarray) -> list[str]:
    """'3.9–7.8' per cell between edges (n + 1,)."""
    texts = [format_number(float(e), 2) for e in edges]
    return [f"{low}–{high}" for low, high in zip(texts, texts[1:], strict=False)]


def worst_table(cells: Sequence[WorstCell]) -> Table:
    """The cells with the largest errors, largest first."""
    columns = (
        *texts("Recording", "Output", "Where"), *numbers("Rms error", "× noise floor")
    )  # fmt: skip
    rows = tuple(
        Row(
            (
                c.recording, channel_symbol(c.channel, c.unit), place(c), quantity(c.rms, c.unit),
                format_number(c.ratio, 3, keep_zeros=True),
            )
        )
        for c in cells
    )  # fmt: skip
    return Table(columns, rows)


def place(cell: WorstCell) -> str:
    """'3.9 to 7.8 Hz'"""
    ends = (format_number(cell.low, 2), format_number(cell.high, 2))
    return f"{ends[0]} to {ends[1]} {cell.axis_unit}"


WINDOW = 0.08
"""s over which the error is averaged: a single sample is noise."""

CAMERA = "camera"
TIP = (("z1", "z2"), ("y1", "y2"), ("ydot1", "ydot2"))
"""What a camera gives, the plainest first."""


@dataclass(frozen=True)
class ErrorNow:
    """The error of one recording over time, in noise floors."""

    time: np.ndarray
    """(N,) s since the start"""
    parts: Mapping[str, np.ndarray]
    """channel of an encoder, a gauge or a drive whose torque is compared, or 'camera' -> (N,)"""
    units: Mapping[str, str] = field(default_factory=dict)
    """channel -> its unit"""

    def at(self, time: float) -> dict[str, float]:
        """part -> error in noise floors at a time in s."""
        k = int(np.clip(np.searchsorted(self.time, time), 0, len(self.time) - 1))
        return {name: float(values[k]) for name, values in self.parts.items()}

    @property
    def worst(self) -> float:
        """The largest error in noise floors; 1 where there is none."""
        return max(
            (float(v.max()) for values in self.parts.values() if len(v := values)), default=1.0
        )


def error_now(seen: RecordingComparison, floors: Mapping[str, float]) -> ErrorNow | None:
    """The error over time; None if no measured part has a noise floor."""
    comparisons = {c.channel: c for c in seen.channels if c.channel in floors}
    if not comparisons:
        return None
    time = next(iter(comparisons.values())).time
    parts = {
        name: np.sqrt(_square(c, floors[name]))
        for name, c in comparisons.items()
        if role_of(name) in (Role.PLACE, Role.DEFLECTION, *DRIVES)
    }
    seen_by = next((names for names in TIP if comparisons.keys() & set(names)), ())
    tip = [_square(comparisons[name], floors[name]) for name in seen_by if name in comparisons]
    if tip:
        parts[CAMERA] = np.sqrt(np.mean(tip, axis=0))
    units = {name: c.unit for name, c in comparisons.items()}
    return ErrorNow(time - time[0], parts, units) if parts else None


def _square(c: ChannelComparison, floor: float) -> np.ndarray:
    """(N,) mean square in noise floors around each sample; zero without counted samples.

    The window holds a sample of a slow camera at any time.
    """
    counts = c.counted & np.isfinite(c.residual)
    square = np.where(counts, (np.nan_to_num(c.residual) / floor) ** 2, 0.0)
    dt = float(c.time[1] - c.time[0]) if len(c.time) > 1 else 1.0
    step = np.median(np.diff(np.flatnonzero(counts))) if counts.sum() > 1 else 1
    half = max(int(0.5 * WINDOW / dt), int(step))
    total, many = (np.concatenate([[0.0], np.cumsum(x)]) for x in (square, counts))
    ends = np.arange(len(square))
    low, high = np.maximum(ends - half, 0), np.minimum(ends + half + 1, len(square))
    return np.asarray((total[high] - total[low]) / np.maximum(many[high] - many[low], 1.0))


def error_text(errors: Mapping[str, float], units: Mapping[str, str] | None = None) -> str:
    """'error at this moment, in noise floors of each output: θ₁ 1.1, camera 35'; `units`: channel
    -> the unit of what it measures."""
    units_of = units or {}
    texts = [
        f"{name if name == CAMERA else channel_symbol(name, units_of.get(name, ''))} "
        f"{format_number(value, 2, keep_zeros=True)}"
        for name, value in errors.items()
    ]
    lead = "error at this moment, in noise floors of each output"
    return f"{lead}: {', '.join(texts)}" if texts else ""
