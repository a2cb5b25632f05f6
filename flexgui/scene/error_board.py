"""The error map as a board on the table before the arm, with cells to click."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from viser import ImageHandle, SceneNodePointerEvent

from flexgui.core.recording.channels import DRIVES, Role, channel_number, role_of
from flexgui.scene import paint
from flexgui.scene.arm_scene import ArmScene, Owner
from flexgui.views import colours
from flexgui.views.error_map import CAMERA, LEAST_SPAN

NAME = "error board"
"""The name under which it is attached to the scene."""

CELL, LINE = 24, 2
"""px of a cell's picture, and of the gap to the next."""

BOARD_WIDTH, BOARD_ROW, LARGEST_BOARD_HEIGHT = 0.95, 0.062, 0.3
"""Of the board and of its rows, as shares of the arm's reach."""

MIDDLE, BEFORE, NEAREST = 0.6, 0.27, -0.4
"""x of its middle, the distance from its upper edge to what is nearest of the arm, and the least y
of that edge: seen from home the board is below the pedestal's foot and above the time-line. An arm
that comes farther passes over it. Shares of the reach."""

LEANING = 0.9
"""rad from upright, so that it faces the viewer."""

EMPTY = (128, 136, 146, 40)
"""Colour of cells without a measurement."""

TITLE = "error over time, recording by recording: click a cell"
MOST_NAMES = 6
"""Rows with a name; of more rows every second or third has one, or names would overlap."""

RIGHT = np.array([1.0, 0.0, 0.0])
DOWN = np.array([0.0, -np.sin(LEANING), -np.cos(LEANING)])
AWAY = np.cross(RIGHT, DOWN)
HALF = 0.5 * float(np.arctan2(DOWN[2], DOWN[1]))
UPRIGHT = (float(np.cos(HALF)), float(np.sin(HALF)), 0.0, 0.0)
"""wxyz of the frame whose x is RIGHT, y DOWN and z AWAY: a turn about x."""

Pick = Callable[[int, int], None]
"""Called with row and column."""


class ErrorBoard:
    """The board; built again for other errors. Only its mark moves."""

    def __init__(
        self, stage: ArmScene, owner: Owner, ratio: np.ndarray, labels: Sequence[str],
        pick: Pick | None, dark: bool = False,
    ) -> None:  # fmt: skip
        """ratio (rows, columns): error in times the floor, NaN where nothing was measured; `dark`:
        for a page of dark ground."""
        self._reach, self._shape = stage.body.reach, ratio.shape
        self.width = BOARD_WIDTH * self._reach
        self.height = min(BOARD_ROW * len(labels), LARGEST_BOARD_HEIGHT) * self._reach
        self.centre = self._place(stage.front)
        stage.detach(NAME)
        place, rows = f"{stage.anchor('base')}_errors_", len(labels)
        self._mark = owner.scene.add_line_segments(
            f"{place}mark", _frame(self.width / ratio.shape[1], self.height / ratio.shape[0]),
            paint.MEASURED, thickness=3.0, thickness_units="screen", visible=False,
        )  # fmt: skip
        picture = owner.scene.add_image(
            f"{place}board", cells(ratio, dark), self.width, self.height, format="png",
            cast_shadow=False, receive_shadow=False, wxyz=UPRIGHT, position=self.centre,
        )  # fmt: skip
        title = owner.scene.add_label(
            f"{place}title", TITLE, position=self._point(0.5, -0.5 / rows), anchor="bottom-center"
        )
        names = [
            owner.scene.add_label(
                f"{place}row{k}", labels[k], position=self._point(-0.015, (k + 0.5) / rows),
                anchor="center-right",
            )
            for k in range(0, rows, -(-rows // MOST_NAMES))
        ]  # fmt: skip
        stage.attach(NAME, picture, self._mark, title, *names)
        if pick is not None:

            @picture.on_click
            def _(event: SceneNodePointerEvent[ImageHandle]) -> None:
                cell = self.cell(event.ray_origin, event.ray_direction)
                if cell is not None:
                    pick(*cell)

    def _place(self, front: float) -> np.ndarray:
        """(3,) m of the middle: the board stands on the table before `front`, m."""
        up = -0.5 * self.height * DOWN
        y = max(front - BEFORE * self._reach, NEAREST * self._reach) - up[1]
        return np.array([MIDDLE * self._reach, y, up[2] - paint.DEPTH * self._reach])

    def mark(self, row: int, share: float) -> None:
        """Marks the cell of a row at a share of the columns."""
        rows, columns = self._shape
        column = min(max(int(share * columns), 0), columns - 1)
        self._mark.position = self._point((column + 0.5) / columns, (row + 0.5) / rows, 0.004)
        self._mark.visible = 0 <= row < rows

    def cell(self, origin: Sequence[float], direction: Sequence[float]) -> tuple[int, int] | None:
        """(row, column) of the cell that a ray meets; None beside the board."""
        start, along = np.asarray(origin, dtype=float), np.asarray(direction, dtype=float)
        slope = float(along @ AWAY)
        if abs(slope) < 1e-9:
            return None
        met = start + along * float((self.centre - start) @ AWAY) / slope - self.centre
        u, v = met @ RIGHT / self.width + 0.5, met @ DOWN / self.height + 0.5
        if not (0.0 <= u < 1.0 and 0.0 <= v < 1.0):
            return None
        return int(v * self._shape[0]), int(u * self._shape[1])

    def _point(self, u: float, v: float, before: float = 0.0) -> np.ndarray:
        """(3,) m at shares of width and height, a little before the board."""
        across = RIGHT * (u - 0.5) * self.width + DOWN * (v - 0.5) * self.height
        return np.asarray(self.centre + across - AWAY * before * self._reach)


def cells(ratio: np.ndarray, dark: bool = False) -> np.ndarray:
    """(rows CELL, columns CELL, 4) uint8 of `ratio` (rows, columns) in noise floors, in the colours
    of the maps; nothing between them."""
    finite = ratio[np.isfinite(ratio)]
    top = float(np.log10(max([LEAST_SPAN, *finite.tolist()])))
    picture = np.zeros((*np.array(ratio.shape) * CELL, 4), dtype=np.uint8)
    for i, j in np.ndindex(ratio.shape):
        is_measured = bool(np.isfinite(ratio[i, j]))
        share = float(np.log10(max(float(ratio[i, j]), 1.0))) / top if is_measured else 0.0
        colour = (*shade(share, dark), 255) if is_measured else EMPTY
        picture[i * CELL : (i + 1) * CELL - LINE, j * CELL : (j + 1) * CELL - LINE] = colour
    return picture


def _frame(width: float, height: float) -> np.ndarray:
    """(4, 2, 3): the rim of a cell around the origin."""
    a, b = 0.5 * width * RIGHT, 0.5 * height * DOWN
    corners = np.array([-a - b, a - b, a + b, -a + b])
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


SHADES = 24
"""Steps of colour, so that small changes send nothing."""


class ErrorPaint(NamedTuple):
    """Colours; None: as usual."""

    hubs: tuple[paint.Rgb | None, ...]
    beams: tuple[paint.Rgb | None, ...]


def error_paint(
    now: Mapping[str, float], joints: int, worst: float, dark: bool = False
) -> ErrorPaint:
    """`now` part -> times the floor; the strongest colour stands for `worst` times the floor."""

    def shown(ratio: float | None) -> paint.Rgb | None:
        if ratio is None or not np.isfinite(ratio):
            return None
        share = np.log10(max(ratio, 1.0)) / np.log10(greatest(worst))
        return shade(round(float(np.clip(share, 0.0, 1.0)) * SHADES) / SHADES, dark)

    camera, drives = now.get(CAMERA), _by_joint(now, *DRIVES)
    places, deflections = _by_joint(now, Role.PLACE), _by_joint(now, Role.DEFLECTION)
    # A rig whose recorded torques are compared shows the missing torque in what each one drives.
    beams = [
        deflections.get(k, drives.get(k) if camera is None else camera)
        for k in range(1, joints + 1)
    ]
    hubs = [places.get(k, drives.get(k)) for k in range(1, joints + 1)]
    return ErrorPaint(tuple(map(shown, hubs)), tuple(map(shown, beams)))


def _by_joint(now: Mapping[str, float], *roles: Role) -> dict[int, float]:
    """Number of the joint -> times the floor, of the channels with one of these roles."""
    return {
        int(channel_number(name)): ratio for name, ratio in now.items() if role_of(name) in roles
    }


def greatest(worst: float) -> float:
    """Times the floor at the end of the colours, where `worst` is the largest error."""
    return max(worst, LEAST_SPAN)


def shade(share: float, dark: bool = False) -> paint.Rgb:
    """A colour of the maps' scale at a `share` of it, 0 the floor, 1 the worst."""
    scale = colours.RISING_ON_DARK if dark else colours.RISING
    stops = [s for s, _ in scale]
    ends = np.array([colours.rgb(c) for _, c in scale], dtype=float)
    mixed = [round(float(np.interp(share, stops, ends[:, k]))) for k in range(3)]
    return mixed[0], mixed[1], mixed[2]
