"""A glance at an effect: the residual that it predicts, over the one that there is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from flexgui.views import colours
from flexgui.views.names import channel_symbol

WIDTH, HEIGHT, EDGE = 340, 64, 3
"""px"""

ROWS = 170
"""As many as the eye tells apart."""

NOISY = 3.0
"""Floors that the picture spans at least on either side, or noise would look large."""


@dataclass(frozen=True)
class Glimpse:
    """A stretch of one output of one recording."""

    recording: str
    channel: str
    seconds: float
    actual: np.ndarray
    """(rows,) in floors."""
    predicted: np.ndarray
    """(rows,) in floors."""


def glimpse(
    recordings: Sequence[str],
    channels: Sequence[Sequence[str]],
    dt: Sequence[float],
    residual: Sequence[np.ndarray],
    predicted: Sequence[np.ndarray],
) -> Glimpse | None:
    """The stretch where the effect predicts most; None where it predicts nothing anywhere."""
    best, place = 0.0, (0, 0, 0)
    for r, block in enumerate(predicted):
        rows = min(ROWS, len(block))
        energy = np.cumsum(np.vstack([np.zeros(block.shape[1]), block.astype(float) ** 2]), axis=0)
        window = energy[rows:] - energy[: len(energy) - rows]
        at, k = divmod(int(np.argmax(window)), window.shape[1])
        if window[at, k] > best:
            best, place = float(window[at, k]), (r, at, k)
    if best <= 0.0 or not len(residual):
        return None
    r, at, k = place
    part = slice(at, at + ROWS)
    return Glimpse(
        recordings[r], channels[r][k], dt[r] * min(ROWS, len(residual[r])),
        residual[r][part, k], predicted[r][part, k],
    )  # fmt: skip


def picture(seen: Glimpse) -> Markup:
    """As SVG, with a line that says what it is."""
    top = max(float(np.nanmax(np.abs(seen.actual))), float(np.nanmax(np.abs(seen.predicted))))
    top = max(top, NOISY)
    lines = Markup("").join(
        Markup("<polyline points='{}' fill='none' stroke='{}' stroke-width='{}'/>").format(
            _points(values, top), colour, width
        )
        for values, colour, width in (
            (seen.actual, colours.faded(colours.RESIDUAL, 0.55), 3.2),
            (seen.predicted, colours.ADDED, 1.3),
        )
    )  # fmt: skip
    middle = HEIGHT / 2.0
    frame = Markup(
        "<svg class='glimpse' viewBox='0 0 {0} {1}' width='100%' height='{1}' "
        "preserveAspectRatio='none' role='img' aria-label='predicted over actual residual'>"
        "<line x1='0' x2='{0}' y1='{2}' y2='{2}' stroke='{3}'/>{4}</svg>"
    )
    told = Markup(
        "<p class='soft'><span class='key' style='background:{}'></span>residual"
        "<span class='key' style='background:{}'></span>"
        "prediction of the effect: {} in recording {}, {:.2g}\N{NO-BREAK SPACE}s</p>"
    )
    return frame.format(WIDTH, HEIGHT, middle, colours.GRID, lines) + told.format(
        colours.RESIDUAL, colours.ADDED, channel_symbol(seen.channel), seen.recording, seen.seconds
    )


def _points(values: np.ndarray, top: float) -> str:
    x = np.linspace(EDGE, WIDTH - EDGE, len(values))
    y = HEIGHT / 2.0 - np.asarray(values, dtype=float) / top * (HEIGHT / 2.0 - EDGE)
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True) if np.isfinite(b))
