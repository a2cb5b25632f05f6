"""Colours and small turns in the form that a scene takes them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from viser import SceneNodeHandle

from flexgui.views import colours

Rgb = tuple[int, int, int]

STEEL: Rgb = (92, 99, 109)
"""Hubs, pedestal, rails: they mean nothing."""
INK: Rgb = (66, 73, 83)
"""Flat marks; the light makes them paler."""
LINE: Rgb = (108, 116, 126)
"""Thin lines, which no light reaches; readable on a light and on a dark ground."""


def rgb(colour: str) -> Rgb:
    """'#rrggbb' as three integers."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


MEASURED, MODEL = rgb(colours.MEASURED), rgb(colours.MODEL)
RESIDUAL, ADDED, CONTEXT = rgb(colours.RESIDUAL), rgb(colours.ADDED), rgb(colours.START)


def about_vertical(angle: float) -> tuple[float, float, float, float]:
    """The quaternion wxyz of a turn in rad about the vertical."""
    return float(np.cos(0.5 * angle)), 0.0, 0.0, float(np.sin(0.5 * angle))


def put(node: SceneNodeHandle, place: Sequence[float] | np.ndarray, angle: float) -> None:
    """Moves a node to a place (3,) in m and turns it about the vertical; what stays is not even
    compared by viser, whose own look for a change takes as long as all the rest."""
    if not np.array_equal(node.position, place):
        node.position = place  # type: ignore[assignment]
    turn = about_vertical(angle)
    if tuple(node.wxyz) != turn:
        node.wxyz = turn
