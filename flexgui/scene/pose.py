"""Where everything of the stage is at one posture; no viser in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.scene.arm_geometry import (
    AS_IT_IS,
    ArmGeometry,
    Section,
    beam_vertices,
    visible_section,
)
from flexgui.sentences.written import channel_symbol

STACK = 0.25
"""Of the reach: segments that stand on the ground beside each other are drawn one above another."""

LIFT = 0.012
"""Of the reach: flat marks float this far above the beams."""

RAIL = 1.2
"""Of the reach: length of the rail below a joint that slides; the joint's zero is its middle."""

ARC_POINTS = 33
ARC_RADIUS, ARC_WIDTH, BASE_LINE = 0.26, 0.018, 0.36
"""Of the segment's length: radius and width of a joint's arc, length of the line it starts from."""
LABEL_RADIUS, LABEL_ASIDE = 0.40, 0.35
"""The text stands by the line that the arc starts from, rad away from the arc's side."""
LABEL_CHANGES = -0.25
"""rad: a joint that swings about zero does not make its text jump from side to side."""


class Spot(NamedTuple):
    """A place (3,) in m and a direction in rad about the vertical."""

    place: np.ndarray
    angle: float


class JointMark(NamedTuple):
    """The angle (or slide) of a joint, as drawn."""

    vertices: np.ndarray
    """(V, 3) float32"""
    text: str
    label: np.ndarray
    """(3,), where the text stands."""


@dataclass(frozen=True)
class Pose:
    """One posture of an arm."""

    beams: tuple[np.ndarray, ...]
    """Vertices (V, 3) float32 of each segment."""
    joints: tuple[Spot, ...]
    """Root of each segment, turned with it."""
    origins: tuple[Spot, ...]
    """Where each joint starts from: the root without its slide, and its zero direction."""
    ends: tuple[Spot, ...]
    """End of each segment."""
    coordinates: tuple[float, ...]
    """Joint positions, rad or m."""

    @property
    def tip(self) -> Spot:
        """The end effector."""
        return self.ends[-1]


class Body:
    """An arm as it is drawn: its geometry with the sections that are seen."""

    def __init__(self, arm: Arm, p: np.ndarray) -> None:
        self.arm, self.p = arm, np.array(p, dtype=float)
        self.geometry = ArmGeometry(arm, p)
        lengths = self.geometry.lengths
        self.sections: tuple[Section, ...] = tuple(
            visible_section(s, length) for s, length in zip(arm.segments, lengths, strict=True)
        )
        stacked = np.array([s.mount == "ground" and k > 0 for k, s in enumerate(arm.segments)])
        self.levels = STACK * self.reach * np.cumsum(stacked)
        """Height of each segment's plane, m."""
        self.grid = 0.0
        """m, of the places of beams and marks; a power of two. 0: as fine as float32 is."""

    @property
    def reach(self) -> float:
        """m"""
        return self.geometry.reach

    def pose(
        self, q: np.ndarray, exaggeration: float = 1.0, grown: tuple[float, float] = AS_IT_IS
    ) -> Pose:
        """The posture q (n,); factors `exaggeration`, 1 to 50, of the modal coordinates only, and
        `grown` of the sections' thickness and height."""
        q = np.asarray(q, dtype=float)
        links = self.geometry.links(q[None], exaggeration)
        parts = list(zip(links, self.sections, self.levels, strict=True))
        return Pose(
            beams=tuple(
                self._placed(beam_vertices(m.line[0], m.slope[0], s, z, grown)) for m, s, z in parts
            ),
            joints=tuple(_spot(m.root, m.angle, z) for m, _, z in parts),
            origins=tuple(_spot(m.origin, m.before, z) for m, _, z in parts),
            ends=tuple(_spot(m.tip, m.tip_angle, z) for m, _, z in parts),
            coordinates=tuple(float(x) for x in q[: self.arm.joints]),
        )

    def _placed(self, vertices: np.ndarray) -> np.ndarray:
        return np.round(vertices / self.grid) * self.grid if self.grid else vertices

    def tip_points(self, q: np.ndarray, exaggeration: float = 1.0) -> np.ndarray:
        """(N, 3) float32 places in m of the tip at postures q (N, n), their bending `exaggeration`
        times as large."""
        z = self.geometry.tips(np.asarray(q, dtype=float), exaggeration)
        return np.column_stack([z, np.full(len(z), self.levels[-1])]).astype(np.float32)

    def front(self, q: np.ndarray) -> float:
        """m, the smallest y of all ends of segments at postures q (N, n); what is not finite does
        not count."""
        y = np.array([link.tip[:, 1] for link in self.geometry.links(np.asarray(q, dtype=float))])
        return float(np.min(y, initial=0.0, where=np.isfinite(y)))

    def rail_ends(self, pose: Pose) -> list[np.ndarray]:
        """(3,) m each, both ends of every rail that stands on the ground."""
        ends = []
        for k, kind in enumerate(self.geometry.kinds):
            if kind.turn or (k and self.arm.segments[k].mount != "ground"):
                continue
            place, angle = pose.origins[k]
            half = 0.5 * RAIL * self.reach * np.array([np.cos(angle), np.sin(angle), 0.0])
            ends += [place - half, place + half]
        return ends

    def marks(self, pose: Pose) -> tuple[JointMark, ...]:
        """The joints' angles in degrees, and slides in m."""
        marks = []
        for k, kind in enumerate(self.geometry.kinds):
            start, value, length = pose.origins[k], pose.coordinates[k], self.geometry.lengths[k]
            top = start.place[2] + 0.5 * self.sections[k].height + LIFT * self.reach
            if kind.turn:
                mark, label = _arc(start, value, length, top)
                # Plus zero: a tiny negative angle is not written as -0.0.
                text = f"{round(float(np.degrees(value)), 1) + 0.0:.1f}°"
            else:
                mark, label = _stroke(start, value, length, top)
                text = f"{value:.3f} m"
            name = channel_symbol(f"theta{k + 1}", "rad" if kind.turn else "m")
            marks.append(JointMark(self._placed(mark), f"{name} = {text}".replace("-", "−"), label))
        return tuple(marks)


def _spot(place: np.ndarray, angle: np.ndarray, level: float) -> Spot:
    return Spot(np.array([place[0, 0], place[0, 1], level]), float(angle[0]))


def _arc(start: Spot, value: float, length: float, top: float) -> tuple[np.ndarray, np.ndarray]:
    """A ring from the zero direction over the joint's angle, one turn at most, and a base line."""
    # Drawn is what is left of whole turns; the text states all.
    drawn = float(np.fmod(value, 2.0 * np.pi))
    direction = start.angle + drawn * np.linspace(0.0, 1.0, ARC_POINTS)
    c, s = np.cos(direction), np.sin(direction)
    rim = np.empty((2, ARC_POINTS, 2))
    inner, outer = (ARC_RADIUS - 0.5 * ARC_WIDTH) * length, (ARC_RADIUS + 0.5 * ARC_WIDTH) * length
    rim[0, :, 0], rim[0, :, 1] = inner * c, inner * s
    rim[1, :, 0], rim[1, :, 1] = outer * c, outer * s
    beside = start.angle - np.copysign(LABEL_ASIDE, value - LABEL_CHANGES)
    label = LABEL_RADIUS * length * np.array([np.cos(beside), np.sin(beside)])
    base = _bar(start.angle, BASE_LINE * length, 0.25 * ARC_WIDTH * length)
    return _flat(rim, base, start, top), np.append(start.place[:2] + label, top)


def _stroke(start: Spot, value: float, length: float, top: float) -> tuple[np.ndarray, np.ndarray]:
    """A bar along the slide, from its zero to the joint."""
    ahead = np.array([np.cos(start.angle), np.sin(start.angle)])
    aside = np.array([-ahead[1], ahead[0]]) * ARC_WIDTH * length
    middle = value * np.linspace(0.0, 1.0, ARC_POINTS)[:, None] * ahead
    rim = np.stack([middle - aside, middle + aside])
    if value < 0.0:
        rim = rim[::-1]
    label = 0.5 * value * ahead + 6.0 * aside
    base = _bar(start.angle + 0.5 * np.pi, 6.0 * ARC_WIDTH * length, 0.5 * ARC_WIDTH * length)
    return _flat(rim, base, start, top), np.append(start.place[:2] + label, top)


def _bar(angle: float, length: float, half: float) -> np.ndarray:
    """(4, 2) corners of a bar from 0 in a direction."""
    ahead = np.array([np.cos(angle), np.sin(angle)])
    aside = half * np.array([-ahead[1], ahead[0]])
    return np.array([-aside, aside, length * ahead - aside, length * ahead + aside])


def _flat(rim: np.ndarray, base: np.ndarray, start: Spot, top: float) -> np.ndarray:
    flat = np.concatenate([rim.reshape(-1, 2), base])
    out = np.full((len(flat), 3), top, dtype=np.float32)
    out[:, :2] = flat + start.place[:2]
    return out


def mark_faces() -> np.ndarray:
    """(F, 3) uint32 of a joint's mark; drawn from both sides."""
    i = np.arange(ARC_POINTS - 1)
    j = i + ARC_POINTS
    ring = np.concatenate([np.stack([i, j, j + 1], 1), np.stack([i, j + 1, i + 1], 1)])
    first = 2 * ARC_POINTS
    base = np.array([(0, 2, 3), (0, 3, 1)]) + first
    return np.concatenate([ring, base]).astype(np.uint32)
