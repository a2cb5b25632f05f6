"""Small pictures of curves as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from flexgui.views import colours
from flexgui.views.layout import trace

PANEL_POINTS = 600
"""Of a line; a panel is about as many pixels wide."""
POINTS = 170
"""As many as the eye distinguishes in a picture that is hardly wider."""
MARGIN = 2.0
"""px above and below, so that a line at an end is seen whole."""


class Curve(NamedTuple):
    """One line of a picture; NaN interrupts it."""

    x: np.ndarray
    """(K,)"""
    y: np.ndarray
    """(K,)"""
    colour: str
    width: float = 1.3
    dash: str = ""


def sketch(
    curves: Sequence[Curve], over: tuple[float, float], size: tuple[int, int], title: str, kind: str
) -> Markup:
    """An SVG of class `kind`; `over`: ends of the y axis; `size`: px; `title`: read aloud."""
    (width, height), (low, high) = size, over
    begin, end = float(curves[0].x[0]), float(curves[0].x[-1])
    lines = []
    for curve in curves:
        x, y = trace(curve.x, curve.y, POINTS)
        finite = np.isfinite(y)
        begins = finite & ~np.concatenate([[False], finite[:-1]])
        across = width * (x - begin) / (end - begin or 1.0)
        up = height - MARGIN - (height - 2.0 * MARGIN) * (y - low) / (high - low or 1.0)
        path = "".join(
            f"{'M' if first else 'L'}{a:.1f} {b:.1f}"
            for first, a, b in zip(begins[finite], across[finite], up[finite], strict=True)
        )
        style = (path, curve.colour, curve.width, curve.dash or "none")
        line = "<path d='{}' fill='none' stroke='{}' stroke-width='{}' stroke-dasharray='{}'/>"
        lines.append(Markup(line).format(*style))
    frame = Markup(
        "<svg class='{}' role='img' aria-label='{}' viewBox='0 0 {w} {h}' width='{w}' height='{h}' "
        "preserveAspectRatio='none'>{}</svg>"
    )
    return frame.format(kind, title, Markup("").join(lines), w=width, h=height)


def sparkline(
    time: np.ndarray,
    shown: np.ndarray,
    expected: np.ndarray | None = None,
    size: tuple[int, int] = (150, 28),
    title: str = "",
) -> Markup:
    """One or two curves over time.

    Args:
        time: s (K,)
        shown: (K,) the signal, in the colour of what was measured; NaN interrupts the line.
        expected: (K,) or of another length over the same time; dashed, in the model's colour.
        size: px, width and height.
        title: What a screen reader says of it.
    """
    curves = [Curve(time, shown, colours.MEASURED)]
    if expected is not None and len(expected) > 1:
        along = np.linspace(float(time[0]), float(time[-1]), len(expected))
        curves.append(Curve(along, expected, colours.MODEL, dash="4 3"))
    finite = np.concatenate([curve.y[np.isfinite(curve.y)] for curve in curves])
    if finite.size == 0:
        return Markup("")
    return sketch(curves, (float(finite.min()), float(finite.max())), size, title, "spark")
