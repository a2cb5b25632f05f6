"""Paths of the tip, measured and modelled, and the error between them as short lines."""

from __future__ import annotations

import numpy as np
from viser import LineSegmentsHandle, SceneApi

from flexgui.stage import paint

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
