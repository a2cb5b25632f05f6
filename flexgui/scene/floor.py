"""The table under the arm, one picture of it, and the arm's soft shadow on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from viser import SceneApi

from flexgui.scene.arm_geometry import middle_line
from flexgui.scene.paint import DEPTH, LIGHT_FROM, Rgb, drawn_late
from flexgui.scene.pose import Body, Pose

RADIUS = 1.5
"""Of the round table, in whose middle the arm stands. A share of the reach, as all lengths here."""
PIXELS = 1024
"""Of the picture's side: as fine as a large screen shows it."""
RIM = 0.010
"""Width of the table's edge."""

FINEST = 0.25
"""Lines are at most so far apart."""
ROUND = (5.0, 2.5, 1.0)
"""Times a power of ten, m: distances of lines that one can count by."""
EVERY = 2
"""So many lines from one strong line to the next."""
WEAK, STRONG = 1.0, 1.5
"""Widths of lines, in pixels of the picture."""

LIGHT: tuple[Rgb, ...] = ((240, 243, 246), (218, 224, 231), (198, 206, 215), (192, 199, 208))
DARK: tuple[Rgb, ...] = ((33, 37, 43), (46, 52, 59), (62, 69, 78), (80, 88, 98))
"""Table, weak and strong lines, and edge."""


def spacing(reach: float) -> float:
    """m between lines, a round number, for a `reach` in m."""
    most = FINEST * reach
    power = float(10.0 ** np.floor(np.log10(most)))
    return next(r * power for r in ROUND if r * power <= most)


def table_picture(reach: float, dark: bool) -> np.ndarray:
    """(PIXELS, PIXELS, 4) uint8: the table of an arm with a `reach` in m, seen from above, x to the
    right and y down; clear around it."""
    table, *above = (np.array(c, dtype=np.float32) for c in (DARK if dark else LIGHT))
    pixel = 2.0 * RADIUS / PIXELS
    places = (np.arange(PIXELS, dtype=np.float32) + 0.5) * pixel - RADIUS
    size = spacing(reach) / reach
    lines = (_lines(places, size, WEAK * pixel), _lines(places, EVERY * size, STRONG * pixel))
    covered = [np.maximum(line[None, :], line[:, None]) for line in lines]
    away = np.hypot(places[None, :], places[:, None])
    covered.append(np.clip((away - RADIUS + RIM) / pixel, 0.0, 1.0))
    picture = np.empty((PIXELS, PIXELS, 4), dtype=np.uint8)
    picture[..., :3], picture[..., 3] = table, 255.0 * np.clip((RADIUS - away) / pixel, 0.0, 1.0)
    for colour, share in zip(above, covered, strict=True):
        row, column = np.nonzero(share)
        part, under = share[row, column, None], picture[row, column, :3]
        picture[row, column, :3] = np.round(under + part * (colour - under))
    return picture


def _lines(places: np.ndarray, far: float, width: float) -> np.ndarray:
    """(N,) shares of the pixels at `places` (N,) that lines cover which are so `far` apart."""
    away = np.abs(places - np.round(places / far) * far)
    return np.asarray(np.clip((0.5 * width - away) / (places[1] - places[0]) + 0.5, 0.0, 1.0))


LAYERS = 4
SOFT = 0.06
"""By how much the widest layer of the shadow is wider than what casts it, on each side."""
OPACITY = {False: 0.045, True: 0.1}
"""Of a layer, on a light and on a dark table."""
STEP = 4
"""So many stations of a beam from one corner of its shadow to the next."""
LIFT = 0.0008
"""Of a layer above the one under it: layers must neither flicker nor darken each other twice."""
PEDESTAL, RAIL_HALF = 0.055, 0.02
"""Half widths."""


class Floor:
    """Table and shadow; built once, the shadow moves with the arm."""

    def __init__(self, scene: SceneApi, path: str, body: Body, pose: Pose, dark: bool) -> None:
        self._reach, self._level = body.reach, -DEPTH * body.reach
        side = 2.0 * RADIUS * body.reach
        self.table = scene.add_image(
            path, table_picture(body.reach, dark), side, side, format="png", cast_shadow=False,
            receive_shadow=False, position=(0.0, 0.0, self._level),
        )  # fmt: skip
        vertices = self._shadow(body, pose)
        self.shadow = scene.add_mesh_simple(
            f"{path}_shadow", vertices, shadow_faces(self._corners), color=(0, 0, 0),
            opacity=OPACITY[dark], material="toon3", cast_shadow=False, receive_shadow=False,
            side="double",
        )  # fmt: skip

    def set_dark(self, dark: bool) -> None:
        """Takes the colours of the dark or the light theme."""
        self.table.image = table_picture(self._reach, dark)
        self.shadow.opacity = OPACITY[dark]

    def show(self, body: Body, pose: Pose) -> None:
        """Moves the shadow."""
        self.shadow.vertices = self._shadow(body, pose)

    def remove(self) -> None:
        """Removes table and shadow."""
        self.table.remove()
        self.shadow.remove()

    def _shadow(self, body: Body, pose: Pose) -> np.ndarray:
        """(V, 3) float32 in m of what beams, pedestal and rails throw on the table."""
        lines = [middle_line(beam)[::STEP] for beam in pose.beams]
        half = [0.5 * section.thickness for section in body.sections]
        if body.geometry.kinds[0].turn:
            lines.append(np.array([[0.0, 0.0, self._level], [0.0, 0.0, 0.0]]))
            half.append(PEDESTAL * self._reach)
        ends = body.rail_ends(pose)
        lines += [np.array(pair) for pair in zip(ends[::2], ends[1::2], strict=True)]
        half += [RAIL_HALF * self._reach] * (len(ends) // 2)
        self._corners = [len(line) + 2 * len(CAP) for line in lines]
        flat = [line[:, :2] - (line[:, 2:] - self._level) * SLANT for line in lines]
        strips = soft_strips(flat, half, SOFT * self._reach, self._level, LIFT * self._reach)
        return drawn_late(strips, self._reach)


SLANT = np.array(LIGHT_FROM[:2]) / LIGHT_FROM[2]
"""By how far a shadow lies aside, against the light, for each m that the arm is above the table."""


CAP = np.linspace(0.0, 0.5 * np.pi, 5)[1:]
"""rad around the end of a line, whose shadow is round there."""


def soft_strips(
    lines: Sequence[np.ndarray], half: Sequence[float], soft: float, level: float, lift: float
) -> np.ndarray:
    """(V, 3) float32 in m: strips along `lines` (k, 2) of widths 2 `half` and up to `soft` more on
    every side, the widest first and lowest, `lift` under the next."""
    parts = []
    for layer in range(LAYERS):
        more = soft * (1.0 - layer / (LAYERS - 1))
        for k, (line, h) in enumerate(zip(lines, half, strict=True)):
            middle, width = _with_caps(line, h + more)
            slope = np.gradient(middle, axis=0)
            ahead = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
            aside = width[:, None] * np.column_stack([-ahead[:, 1], ahead[:, 0]])
            z = np.full(len(middle), level + lift * (layer + 1 - k / (len(lines) + 1)))
            parts += [np.column_stack([middle + s * aside, z]) for s in (1.0, -1.0)]
    return np.concatenate(parts).astype(np.float32)


def _with_caps(line: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """The line (k, 2) with the points of both half circles, and half the width at each point."""
    first, last = (
        d / max(float(np.linalg.norm(d)), 1e-9) for d in (line[0] - line[1], line[-1] - line[-2])
    )
    beyond = radius * np.sin(CAP)[:, None]
    width = np.full(len(line), radius)
    caps = radius * np.cos(CAP)
    middle = [line[0] + beyond[::-1] * first, line, line[-1] + beyond * last]
    return np.concatenate(middle), np.concatenate([caps[::-1], width, caps])


def shadow_faces(corners: Sequence[int]) -> np.ndarray:
    """(F, 3) uint32 of `soft_strips` along lines of so many points each."""
    faces, first = [], 0
    for count in (c for _ in range(LAYERS) for c in corners):
        i = first + np.arange(count - 1)
        j = i + count
        faces += [np.column_stack([i, j, j + 1]), np.column_stack([i, j + 1, i + 1])]
        first += 2 * count
    return np.concatenate(faces).astype(np.uint32)
