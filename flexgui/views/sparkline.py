"""A signal as a small picture in a line of text: drawn by the browser, without a plot's cost."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from flexgui.views import colours
from flexgui.views.decimate import trace

POINTS = 160
"""A picture is about as many pixels wide."""
MARGIN = 2.0
"""px above and below, so that a line at an end is seen whole."""


def sparkline(
    time: np.ndarray,
    shown: np.ndarray,
    expected: np.ndarray | None = None,
    size: tuple[int, int] = (150, 28),
    title: str = "",
) -> Markup:
    """An SVG of one or two curves over time.

    Args:
        time: s (K,)
        shown: (K,) the signal, in the colour of what was measured; NaN interrupts the line.
        expected: (K,) or of another length over the same time; dashed, in the model's colour.
        size: px, width and height.
        title: What a screen reader says of it.
    """
    curves = [(time, shown, colours.MEASURED, "")]
    if expected is not None and len(expected) > 1:
        along = np.linspace(float(time[0]), float(time[-1]), len(expected))
        curves.append((along, expected, colours.MODEL, "4 3"))
    finite = np.concatenate([y[np.isfinite(y)] for _, y, _, _ in curves])
    if finite.size == 0:
        return Markup("")
    low, high = float(finite.min()), float(finite.max())
    begin, end = float(time[0]), float(time[-1])
    lines = Markup("").join(
        _line(_path(x, y, (begin, end), (low, high), size), colour, dash)
        for x, y, colour, dash in curves
    )
    frame = Markup("<svg class='spark' role='img' aria-label='{}' viewBox='0 0 {} {}' {}>{}</svg>")
    shape = Markup("width='{}' height='{}' preserveAspectRatio='none'").format(*size)
    return frame.format(title, *size, shape, lines)


def _line(path: str, colour: str, dash: str) -> Markup:
    line = Markup("<path d='{}' fill='none' stroke='{}' stroke-width='1.3' {}/>")
    dashed = Markup("stroke-dasharray='{}'").format(dash) if dash else ""
    return line.format(path, colour, dashed)


def _path(
    x: np.ndarray,
    y: np.ndarray,
    along: tuple[float, float],
    over: tuple[float, float],
    size: tuple[int, int],
) -> str:
    """'M0.0 14.0L1.0 13.2…' with a new piece behind every gap."""
    x, y = trace(x, y, POINTS)
    width, height = size
    span, rise = along[1] - along[0] or 1.0, over[1] - over[0] or 1.0
    across = width * (np.asarray(x) - along[0]) / span
    up = height - MARGIN - (height - 2.0 * MARGIN) * (np.asarray(y) - over[0]) / rise
    pieces, drawing = [], False
    for a, b in zip(across, up, strict=True):
        if not np.isfinite(b):
            drawing = False
            continue
        pieces.append(f"{'L' if drawing else 'M'}{a:.1f} {b:.1f}")
        drawing = True
    return "".join(pieces)
