"""Places along an arm in numbers, from the statement of core.arm.kinematics, for many postures."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.joints import joint
from flexgui.core.arm.segment import Segment
from flexgui.core.arm.slots import AXIS_ANGLE, LENGTH, slot

STATIONS = 21
"""Cross-sections of a bending beam; a curve of them looks smooth."""


class Link(NamedTuple):
    """One segment of N postures, in the plane of the arm."""

    root: np.ndarray
    """(N, 2) m"""
    before: np.ndarray
    """(N,) rad, the direction that the joint starts from."""
    origin: np.ndarray
    """(N, 2) m, the root without the joint's slide."""
    angle: np.ndarray
    """(N,) rad, direction of the segment at its root."""
    line: np.ndarray
    """(N, stations, 2) m, its middle line."""
    slope: np.ndarray
    """(N, stations) rad, direction of that line."""

    @property
    def tip(self) -> np.ndarray:
        """(N, 2) m"""
        return self.line[:, -1]

    @property
    def tip_angle(self) -> np.ndarray:
        """(N,) rad"""
        return self.slope[:, -1]


@dataclass(frozen=True)
class JointKind:
    """What a joint does, as numbers: `Placement` of core.arm.joints is linear in its symbols."""

    turn: float
    slide: float
    direction: float
    """Share of the axis angle in the direction of the slide."""


@cache
def joint_kind(kind: str) -> JointKind:
    """Derived once: symbols are slow, and a slider of the arm makes a new geometry at each move."""
    import sympy as sp

    coordinate, axis = sp.symbols("coordinate axis", real=True)
    put = joint(kind).place(coordinate, axis)
    slopes = (put.turn.diff(coordinate), put.slide.diff(coordinate), put.direction.diff(axis))
    return JointKind(*(float(s) for s in slopes))


class Shape:
    """Tables of one segment's assumed modes at its stations."""

    def __init__(self, modes: int, length: float) -> None:
        from flexgui.core.arm import shapes

        self.x, self.step = np.linspace(0.0, length, STATIONS, retstep=True)
        # Midpoints between the stations too, for Simpson's rule.
        fine = np.linspace(0.0, length, 2 * STATIONS - 1)
        a = np.array([shapes.exponent(i) for i in range(modes)], dtype=float)
        self.deflection = self.x ** a[:, None]
        self.slope = a[:, None] * fine ** (a[:, None] - 1.0)
        c = a[:, None] + a - 1.0
        self.shortening = -(np.outer(a, a) / (2.0 * c))[..., None] * self.x ** c[..., None]

    def stated(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Along and across (N, stations): the model's own statement, second order in v (N, m)."""
        along = self.x + np.einsum("ni,nj,ijx->nx", v, v, self.shortening)
        return along, v @ self.deflection

    def inextensible(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same to second order in v (N, m), but the line keeps its length however far it
        bends."""
        direction = v @ self.slope
        return np.cos(direction) @ self.integral, np.sin(direction) @ self.integral

    @cached_property
    def integral(self) -> np.ndarray:
        """(2 S - 1, S) m: from values between and at the S stations to the integral up to each."""
        total = np.zeros((self.slope.shape[1], len(self.x)))
        for k in range(1, len(self.x)):  # Simpson's rule between each two stations
            total[2 * k - 2 : 2 * k + 1, k:] += self.step / 6.0 * np.array([[1.0], [4.0], [1.0]])
        return total


class ArmGeometry:
    """The links of an arm with numbers p (core.arm.slots) at any postures."""

    def __init__(self, arm: Arm, p: np.ndarray) -> None:
        self.arm = arm
        count = arm.joints
        self.lengths = [float(p[slot(k, LENGTH)]) for k in range(count)]
        self.axes = [float(p[slot(k, AXIS_ANGLE)]) for k in range(count)]
        self.kinds = [joint_kind(s.joint) for s in arm.segments]
        self.shapes = [Shape(m, length) for m, length in zip(arm.modes, self.lengths, strict=True)]

    @property
    def reach(self) -> float:
        """m, the length of the longest chain."""
        best = total = 0.0
        for segment, length in zip(self.arm.segments, self.lengths, strict=True):
            total = length if segment.mount == "ground" else total + length
            best = max(best, total)
        return best

    def links(self, q: np.ndarray, exaggeration: float = 1.0) -> list[Link]:
        """Each segment at postures q (N, n); `exaggeration`: factor of the modal coordinates.

        At 1 these are the model's own formulas, so the tip is that of the simulator. Above 1 the
        foreshortening, of second order, would shrink the arm to nothing: there the line bends
        without a change of length, which is the same to second order.
        """
        count = len(q)
        place, angle = np.zeros((count, 2)), np.zeros(count)
        links = []
        for k, (segment, kind) in enumerate(zip(self.arm.segments, self.kinds, strict=True)):
            if segment.mount == "ground":
                place, angle = np.zeros((count, 2)), np.zeros(count)
            link = self._link(k, kind, q, exaggeration, place, angle)
            links.append(link)
            place, angle = link.tip, link.tip_angle
        return links

    def _link(
        self,
        k: int,
        kind: JointKind,
        q: np.ndarray,
        exaggeration: float,
        place: np.ndarray,
        angle: np.ndarray,
    ) -> Link:
        direction = angle + kind.direction * self.axes[k]
        slide = kind.slide * q[:, k]
        root = place + slide[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
        turned = angle + kind.turn * q[:, k]
        v, shape = exaggeration * q[:, self.arm.modal_slice(k)], self.shapes[k]
        along, across = shape.stated(v) if exaggeration == 1.0 else shape.inextensible(v)
        c, s = np.cos(turned)[:, None], np.sin(turned)[:, None]
        line = np.empty((*along.shape, 2))
        line[..., 0] = root[:, :1] + c * along - s * across
        line[..., 1] = root[:, 1:] + s * along + c * across
        before = direction if kind.slide else angle
        slope = turned[:, None] + v @ shape.slope[:, ::2]
        return Link(root, before, place, turned, line, slope)

    def tips(self, q: np.ndarray, exaggeration: float = 1.0) -> np.ndarray:
        """z (N, 2) in m of the end effector at postures q (N, n), their bending `exaggeration`
        times as large."""
        return self.links(q, exaggeration)[-1].tip


STRIP = (0.022, 0.12)
"""Thickness and height over length of a strip whose section nobody stated (EI only)."""
RIGID = (0.07, 0.07)
"""The same of a rigid segment."""
THINNEST = 0.012
"""Of the length: thinner beams could not be seen."""

CORNERS = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)], dtype=float) / 2.0
"""(across, up), in thickness and height."""
EDGE_COLUMNS = [0, 1, 1, 2, 2, 3, 3, 0]
"""Each side has its own two edges, so that the edges of the beam stay sharp when lit."""


class Section(NamedTuple):
    """What of a beam is seen, in m: across in the plane of the arm, and up."""

    thickness: float
    height: float


def visible_section(segment: Segment, length: float) -> Section:
    """The real square section where it is known; else a size that looks like its kind at that
    `length` in m."""
    if segment.width is not None:
        shown = max(segment.width, THINNEST * length)
        return Section(shown, shown)
    thickness, height = STRIP if segment.modes else RIGID
    return Section(thickness * length, height * length)


AS_IT_IS = (1.0, 1.0)
"""Factors of thickness and height."""


def beam_vertices(
    line: np.ndarray, slope: np.ndarray, section: Section, level: float,
    grown: tuple[float, float] = AS_IT_IS,
) -> np.ndarray:  # fmt: skip
    """(V, 3) float32 in m: the section swept along a middle line (stations, 2) with directions
    `slope` (stations,) in rad, at height `level`.

    `grown`: factors of its thickness and height.
    """
    corners = CORNERS * (np.array(section) * np.array(grown))
    normal = np.empty_like(line)
    normal[:, 0], normal[:, 1] = -np.sin(slope), np.cos(slope)
    rings = np.empty((len(line), 4, 3), dtype=np.float32)
    rings[:, :, :2] = line[:, None, :] + normal[:, None, :] * corners[None, :, :1]
    rings[:, :, 2] = level + corners[:, 1]
    sides = rings[:, EDGE_COLUMNS].reshape(-1, 3)
    return np.concatenate([sides, rings[0], rings[-1]])


def middle_line(beam: np.ndarray) -> np.ndarray:
    """(stations, 3) in m, of vertices that `beam_vertices` gives."""
    return np.asarray(beam[: 8 * STATIONS].reshape(STATIONS, 8, 3).mean(axis=1))


def beam_faces() -> np.ndarray:
    """(F, 3) uint32, outward; the vertices are those of `beam_vertices`."""
    faces = []
    for i in range(STATIONS - 1):
        for side in range(4):
            a, b = 8 * i + 2 * side, 8 * i + 2 * side + 1
            faces += [(a, a + 8, b + 8), (a, b + 8, b)]
    first = 8 * STATIONS
    last = first + 4
    faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    faces += [(last, last + 2, last + 1), (last, last + 3, last + 2)]
    return np.array(faces, dtype=np.uint32)
