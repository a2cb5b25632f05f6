"""The tip camera above the arm, its picture on the plane of the arm, and the cross it sees."""

from __future__ import annotations

import numpy as np
from viser import LineSegmentsHandle, SceneApi

from flexgui.stage import paint
from flexgui.stage.pose import Body, Pose

POINTS = 500
"""Of a path; more would not be seen."""
ERRORS = 60
"""Error lines; more would hide the paths."""
NOTHING = np.zeros((1, 2, 3), dtype=np.float32)


class PathNodes:
    """Built once; each change replaces the points in place."""

    def __init__(self, scene: SceneApi, path: str, lift: float) -> None:
        self.scene, self.path, self.lift = scene, path, lift
        self.model = self._lines("model", paint.MODEL, 2.5)
        self.measured = self._lines("measured", paint.MEASURED, 2.5)
        self.errors = self._lines("errors", paint.RESIDUAL, 2.0)
        self.now = self._lines("error_now", paint.RESIDUAL, 4.0)

    def show(self, model: np.ndarray | None, measured: np.ndarray | None) -> None:
        """Tip paths (N, 3) of the same samples; None where there is none."""
        self._put(self.model, None if model is None else polyline(model))
        self._put(self.measured, None if measured is None else polyline(measured))
        both = None if model is None or measured is None else error_lines(model, measured)
        self._put(self.errors, both)

    def show_error(self, model: np.ndarray, measured: np.ndarray | None) -> None:
        """The error at this moment between two places (3,)."""
        self._put(self.now, None if measured is None else np.array([[model, measured]]))

    def _lines(self, name: str, colour: paint.Rgb, thickness: float) -> LineSegmentsHandle:
        return self.scene.add_line_segments(
            f"{self.path}/{name}", NOTHING, colour, thickness=thickness, thickness_units="screen",
            visible=False, position=(0.0, 0.0, self.lift),
        )  # fmt: skip

    def _put(self, handle: LineSegmentsHandle, points: np.ndarray | None) -> None:
        if points is not None and len(points):
            handle.points = points.astype(np.float32)
        handle.visible = points is not None and len(points) > 0


def polyline(path: np.ndarray) -> np.ndarray:
    """(k, 2, 3) segments of a path (N, 3), at most POINTS of them."""
    chosen = path[_spread(len(path), POINTS)]
    return np.stack([chosen[:-1], chosen[1:]], axis=1)


def error_lines(model: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """(k, 2, 3) from model to measured, at most ERRORS of them."""
    index = _spread(min(len(model), len(measured)), ERRORS)
    return np.stack([model[index], measured[index]], axis=1)


def _spread(count: int, most: int) -> np.ndarray:
    """Indices of at most so many of `count`, evenly, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


HEIGHT = 0.40
"""Of the camera above the arm, as a share of the reach."""
PICTURE = (0.36, 0.26)
"""Width and depth of what it sees, as shares of the reach."""
SIZE = 0.07
CROSS = 0.04
PALE = (150, 184, 226)
MARGIN = 0.85
"""The camera is moved when the tip leaves this share of the picture's half width."""
DOWN = (0.0, 1.0, 0.0, 0.0)
"""wxyz of a camera that looks down with its picture's upper edge towards +y."""


class CameraNodes:
    """Built once; follows the tip only when it leaves the picture, as it is moved on the rig."""

    def __init__(self, scene: SceneApi, path: str, body: Body, pose: Pose, tip_path: str) -> None:
        self.reach = body.reach
        self.top = 0.5 * body.sections[-1].height
        self.centre = np.full(2, np.inf)
        self.frame = scene.add_frame(f"{path}/place", show_axes=False)
        self._build(scene)
        self.cross = scene.add_line_segments(
            f"{tip_path}/cross", self._cross(), paint.LINE, thickness=2.5, thickness_units="screen",
            position=(0.0, 0.0, self.top + 0.02 * self.reach),
        )  # fmt: skip
        self.show(pose)

    def show(self, pose: Pose) -> None:
        """Re-positions the camera where the tip has left its picture."""
        tip = pose.tip.place
        limits = 0.5 * MARGIN * self.reach * np.array(PICTURE)
        if np.all(np.abs(tip[:2] - self.centre) <= limits):
            return
        self.centre = tip[:2].copy()
        self.frame.position = (tip[0], tip[1], tip[2] + self.top)

    def _build(self, scene: SceneApi) -> None:
        width, depth = (share * self.reach for share in PICTURE)
        height = HEIGHT * self.reach
        fov = 2.0 * float(np.arctan2(0.5 * depth, height))
        scene.add_camera_frustum(
            f"{self.frame.name}/camera", fov, width / depth, scale=SIZE * self.reach,
            thickness=2.0, thickness_units="screen", color=paint.MEASURED, wxyz=DOWN,
            position=(0.0, 0.0, height), variant="filled", cast_shadow=False,
        )  # fmt: skip
        corners = 0.5 * np.array(
            [(-width, -depth), (width, -depth), (width, depth), (-width, depth)]
        )
        edge = np.column_stack([corners, np.zeros(4)])
        eye = np.array([0.0, 0.0, height])
        rays = np.array([(eye, corner) for corner in edge])
        rim = np.array([(edge[i], edge[(i + 1) % 4]) for i in range(4)])
        name = self.frame.name
        scene.add_line_segments(f"{name}/rays", rays, PALE, thickness=1.2, thickness_units="screen")
        scene.add_line_segments(
            f"{name}/picture", rim, paint.MEASURED, thickness=1.8, thickness_units="screen"
        )

    def _cross(self) -> np.ndarray:
        a = CROSS * self.reach
        return np.array([[(-a, 0, 0), (a, 0, 0)], [(0, -a, 0), (0, a, 0)]], dtype=float)
