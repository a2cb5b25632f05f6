"""The cross-section of a beam and the mesh that it sweeps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.arm.segment import Segment
from flexgui.stage.geometry import STATIONS

STRIP = (0.022, 0.12)
"""Thickness and height over length of a strip whose section nobody stated (EI only)."""
RIGID = (0.07, 0.07)
"""The same of a rigid segment."""
THINNEST = 0.012
"""Of the length: thinner beams could not be seen."""

CORNERS = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)], dtype=float) / 2.0
"""(across, up), in thickness and height."""
COLUMNS = [0, 1, 1, 2, 2, 3, 3, 0]
"""Each side has its own two edges, so that the edges of the beam stay sharp when lit."""


class Section(NamedTuple):
    """What of a beam is seen, in m: across in the plane of the arm, and up."""

    thickness: float
    height: float


def visible_section(segment: Segment, length: float) -> Section:
    """The real square section where it is known; else a size that looks like its kind."""
    if segment.width is not None:
        shown = max(segment.width, THINNEST * length)
        return Section(shown, shown)
    thickness, height = STRIP if segment.modes else RIGID
    return Section(thickness * length, height * length)


def beam_vertices(
    line: np.ndarray, slope: np.ndarray, section: Section, level: float, grown: float = 1.0
) -> np.ndarray:
    """(V, 3) float32: the section swept along a middle line (stations, 2) at height `level`.

    `grown` makes it a little larger, so that a translucent twin does not flicker in it.
    """
    corners = CORNERS * (np.array(section) * grown)
    normal = np.empty_like(line)
    normal[:, 0], normal[:, 1] = -np.sin(slope), np.cos(slope)
    rings = np.empty((len(line), 4, 3), dtype=np.float32)
    rings[:, :, :2] = line[:, None, :] + normal[:, None, :] * corners[None, :, :1]
    rings[:, :, 2] = level + corners[:, 1]
    sides = rings[:, COLUMNS].reshape(-1, 3)
    return np.concatenate([sides, rings[0], rings[-1]])


def beam_faces(stations: int = STATIONS) -> np.ndarray:
    """(F, 3) uint32, outward; the vertices are those of `beam_vertices`."""
    faces = []
    for i in range(stations - 1):
        for side in range(4):
            a, b = 8 * i + 2 * side, 8 * i + 2 * side + 1
            faces += [(a, a + 8, b + 8), (a, b + 8, b)]
    first = 8 * stations
    last = first + 4
    faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    faces += [(last, last + 2, last + 1), (last, last + 3, last + 2)]
    return np.array(faces, dtype=np.uint32)
