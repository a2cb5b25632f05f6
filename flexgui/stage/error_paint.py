"""The arm in the colours of its error: hubs by the encoders, beams and tip by the camera."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from flexgui.stage import paint
from flexgui.views import colours
from flexgui.views.error_map import CAMERA

SHADES = 24
"""Colours are only sent where they change."""

LEAST_SPAN = 10.0
"""Times the floor that the colours span at least, as on the maps."""


class ErrorPaint(NamedTuple):
    """Colours; None: as usual."""

    hubs: tuple[paint.Rgb | None, ...]
    beams: tuple[paint.Rgb | None, ...]


def error_paint(now: Mapping[str, float], joints: int, worst: float) -> ErrorPaint:
    """`now` part -> times the floor; the darkest colour stands for `worst`."""
    camera = now.get(CAMERA)
    hubs = tuple(_shade(now.get(f"theta{k + 1}"), worst) for k in range(joints))
    beams = tuple(_shade(now.get(f"deflection{k + 1}", camera), worst) for k in range(joints))
    return ErrorPaint(hubs, beams)


def _shade(ratio: float | None, worst: float) -> paint.Rgb | None:
    if ratio is None or not np.isfinite(ratio):
        return None
    share = np.log10(max(ratio, 1.0)) / np.log10(max(worst, LEAST_SPAN))
    return shade(round(float(np.clip(share, 0.0, 1.0)) * SHADES) / SHADES)


def shade(share: float) -> paint.Rgb:
    """A colour of the maps' scale, 0 the floor, 1 the worst."""
    stops = [s for s, _ in colours.RISING]
    ends = np.array([paint.rgb(c) for _, c in colours.RISING], dtype=float)
    mixed = [round(float(np.interp(share, stops, ends[:, k]))) for k in range(3)]
    return mixed[0], mixed[1], mixed[2]
