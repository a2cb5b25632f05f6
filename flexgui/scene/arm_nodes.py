"""The nodes of one arm in a scene, beams, hubs and tip, and those of its camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from viser import LabelHandle, LineSegmentsHandle, MeshHandle, SceneApi

from flexgui.scene import paint
from flexgui.scene.arm_geometry import AS_IT_IS, beam_faces
from flexgui.scene.pose import RAIL, Body, Pose, Spot, mark_faces

LABEL_SCALE = 1.25


class MarkNodes:
    """Arcs and texts of the joints' angles, built once."""

    def __init__(self, scene: SceneApi, path: str, body: Body, pose: Pose) -> None:
        self.arcs: list[MeshHandle] = []
        self.labels: list[LabelHandle] = []
        for k, mark in enumerate(body.marks(pose), start=1):
            arc = scene.add_mesh_simple(
                f"{path}/arc{k}", mark.vertices, mark_faces(), color=paint.INK, side="double",
                cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
            label = scene.add_label(
                f"{path}/label{k}", mark.text, position=mark.label, anchor="center-center",
                font_screen_scale=LABEL_SCALE,
            )  # fmt: skip
            self.arcs.append(arc)
            self.labels.append(label)

    def show(self, body: Body, pose: Pose) -> None:
        """Moves arcs and labels, and writes the angles."""
        for arc, label, mark in zip(self.arcs, self.labels, body.marks(pose), strict=True):
            arc.vertices = mark.vertices
            label.position = mark.label
            label.text = mark.text


HUB_HEIGHT = 1.35
"""Of the beam's height."""
LEAST_HUB, HUB_SHARE = 0.035, 0.62
"""Radius: at least this share of the reach, and this one of the beam's thickness."""
TIP_RADIUS = 0.018
PEDESTAL_RADIUS = 0.055
"""All are shares of the reach."""


class Style(NamedTuple):
    """How an arm looks."""

    colour: paint.Rgb
    opacity: float | None = None
    grown: tuple[float, float] = AS_IT_IS
    """Factors of thickness and height."""
    machine: bool = True
    """Whether it has hubs and a pedestal; a ghost is only what bends."""


MODEL = Style(paint.MODEL)
GHOST = Style(paint.MEASURED, opacity=0.5, grown=(2.6, 0.4), machine=False)
"""A flat body around the model's, which shows on both sides of it and leaves its top free."""


class ArmNodes:
    """Built once; `show` moves what is there."""

    def __init__(self, scene: SceneApi, path: str, body: Body, style: Style, pose: Pose) -> None:
        self.scene, self.style, self._reach = scene, style, body.reach
        self.beams: list[MeshHandle] = [
            scene.add_mesh_simple(
                f"{path}/beam{k}", vertices, beam_faces(), color=style.colour,
                opacity=style.opacity, cast_shadow=style.machine, receive_shadow=False,
            )
            for k, vertices in enumerate(self._beams(pose), start=1)
        ]  # fmt: skip
        self.joints, self.origins, self.ends = (
            [
                scene.add_frame(
                    f"{path}/{name}{k}",
                    show_axes=False,
                    position=spot.place,
                    wxyz=paint.about_vertical(spot.angle),
                )
                for k, spot in enumerate(spots, start=1)
            ]
            for name, spots in zip(("joint", "origin", "end"), self._spots(pose), strict=True)
        )
        self.tip = scene.add_icosphere(
            f"{self.ends[-1].name}/marker", TIP_RADIUS * body.reach, style.colour,
            opacity=style.opacity, cast_shadow=False, receive_shadow=False,
            position=(0.0, 0.0, 0.5 * body.sections[-1].height),
        )  # fmt: skip
        self.hubs = [self._hub(k, body) for k in range(len(self.joints))]
        self.rebuild(body)

    def show(self, pose: Pose) -> None:
        """Moves everything to a pose."""
        for beam, vertices in zip(self.beams, self._beams(pose), strict=True):
            beam.vertices = vertices
        for group in zip((self.joints, self.origins, self.ends), self._spots(pose), strict=True):
            for frame, spot in zip(*group, strict=True):
                paint.put(frame, spot.place, spot.angle)

    def _beams(self, pose: Pose) -> Sequence[np.ndarray]:
        if self.style.opacity is None:
            return pose.beams
        return [paint.drawn_late(vertices, self._reach) for vertices in pose.beams]

    def _spots(self, pose: Pose) -> tuple[tuple[Spot, ...], ...]:
        """Of joints, origins and ends; of a ghost the last end alone, which carries its tip."""
        ends = ((), (), pose.ends[-1:])
        return (pose.joints, pose.origins, pose.ends) if self.style.machine else ends

    def paint(self, beams: Sequence[paint.Rgb | None], hubs: Sequence[paint.Rgb | None]) -> None:
        """Other colours than usual, None: the usual one; the tip has that of the last beam."""
        for handles, usual, colours in (
            (self.beams, self.style.colour, beams),
            (self.hubs, paint.STEEL, hubs),
            ([self.tip], self.style.colour, beams[-1:]),
        ):
            for handle, colour in zip(handles, colours, strict=False):
                colour = usual if colour is None else colour
                if tuple(handle.color) != colour:
                    handle.color = colour

    def rebuild(self, body: Body) -> None:
        """Sizes of the hubs for other sections."""
        for k, hub in enumerate(self.hubs):
            section, thickest = body.sections[k], body.sections[max(k - 1, 0)]
            across = max(section.thickness, thickest.thickness)
            radius = max(HUB_SHARE * across * 1.25, LEAST_HUB * body.reach)
            hub.scale = (radius, radius, HUB_HEIGHT * max(section.height, thickest.height))

    def _hub(self, k: int, body: Body):  # type: ignore[no-untyped-def]
        """A unit cylinder that turns with the joint, or a unit box on a rail."""
        name = f"{self.joints[k].name}/hub"
        if not k or body.arm.segments[k].mount == "ground":
            self._add_base(k, body)
        if body.geometry.kinds[k].turn:
            return self.scene.add_cylinder(name, 1.0, 1.0, paint.STEEL, receive_shadow=False)
        return self.scene.add_box(name, paint.STEEL, (2.0, 2.0, 1.0), receive_shadow=False)

    def _add_base(self, k: int, body: Body) -> None:
        """A pedestal to the floor below a turning joint, a rail on two feet below a sliding one."""
        reach, level = body.reach, body.levels[k]
        height = paint.DEPTH * reach if not k else level - body.levels[k - 1]
        origin = self.origins[k].name
        if body.geometry.kinds[k].turn:
            self.scene.add_cylinder(
                f"{origin}/pedestal", PEDESTAL_RADIUS * reach, height, paint.CONTEXT,
                position=(0.0, 0.0, -0.5 * height), receive_shadow=False,
            )  # fmt: skip
        else:
            drop = 0.5 * body.sections[k].height
            self.scene.add_box(
                f"{origin}/rail", paint.CONTEXT, (RAIL * reach, 0.04 * reach, 0.02 * reach),
                position=(0.0, 0.0, -drop - 0.01 * reach), receive_shadow=False,
            )  # fmt: skip


PATH_POINTS = 500
"""Of a path; more would not be seen."""
ERRORS = 60
"""Error lines; more would hide the paths."""
NO_LINE = np.zeros((1, 2, 3), dtype=np.float32)


class PathNodes:
    """Built once; each change replaces the points in place."""

    def __init__(self, scene: SceneApi, path: str, lift: float) -> None:
        self.model, self.measured, self.errors, self.now = (
            scene.add_line_segments(
                f"{path}/{name}", NO_LINE, colour, thickness=thickness, visible=False,
                thickness_units="screen", position=(0.0, 0.0, lift),
            )
            for name, colour, thickness in (
                ("model", paint.MODEL, 2.5), ("measured", paint.MEASURED, 2.5),
                ("errors", paint.RESIDUAL, 2.0), ("error_now", paint.RESIDUAL, 4.0),
            )
        )  # fmt: skip

    def show(self, model: np.ndarray | None, measured: np.ndarray | None) -> None:
        """Tip paths (N, 3) in m, `model` and `measured`, of the same samples; None where there is
        none."""
        _put(self.model, None if model is None else polyline(model))
        _put(self.measured, None if measured is None else polyline(measured))
        both = None if model is None or measured is None else error_lines(model, measured)
        _put(self.errors, both)

    def show_error(self, model: np.ndarray, measured: np.ndarray | None = None) -> None:
        """The error at this moment between two places (3,) in m, `model` and `measured`."""
        _put(self.now, None if measured is None else np.array([[model, measured]]))


def _put(handle: LineSegmentsHandle, points: np.ndarray | None) -> None:
    if points is not None and len(points):
        handle.points = points.astype(np.float32)
    paint.switch(handle, points is not None and len(points) > 0)


def polyline(path: np.ndarray) -> np.ndarray:
    """(k, 2, 3) segments of a path (N, 3), at most PATH_POINTS of them."""
    chosen = path[_spread(len(path), PATH_POINTS)]
    return np.stack([chosen[:-1], chosen[1:]], axis=1)


def error_lines(model: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """(k, 2, 3) from model (N, 3) to measured (N, 3), at most ERRORS of them."""
    index = _spread(min(len(model), len(measured)), ERRORS)
    return np.stack([model[index], measured[index]], axis=1)


def _spread(count: int, most: int) -> np.ndarray:
    """Indices of at most so many of `count`, evenly, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


CAMERA_HEIGHT = 0.40
"""Of the camera above the arm, as a share of the reach."""
PICTURE = (0.36, 0.26)
"""Width and depth of what it sees, as shares of the reach."""
SIZE = 0.07
CROSS = 0.04
PALE = (150, 184, 226)
TIP_MARGIN = 0.85
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
        width, depth, height, size, cross = (
            share * self.reach for share in (*PICTURE, CAMERA_HEIGHT, SIZE, CROSS)
        )
        scene.add_camera_frustum(
            f"{self.frame.name}/camera", 2.0 * float(np.arctan2(0.5 * depth, height)),
            width / depth, scale=size, thickness=2.0, thickness_units="screen",
            color=paint.MEASURED, wxyz=DOWN, position=(0.0, 0.0, height), variant="filled",
            cast_shadow=False,
        )  # fmt: skip
        ends = np.array([(-width, -depth), (width, -depth), (width, depth), (-width, depth)])
        rim = np.column_stack([0.5 * ends, np.zeros(4)])
        eye = np.broadcast_to([0.0, 0.0, height], rim.shape)
        for name, points, colour, thickness in (
            ("rays", np.stack([eye, rim], axis=1), PALE, 1.2),
            ("picture", np.stack([rim, np.roll(rim, -1, axis=0)], axis=1), paint.MEASURED, 1.8),
        ):
            scene.add_line_segments(
                f"{self.frame.name}/{name}", points, colour, thickness=thickness,
                thickness_units="screen",
            )  # fmt: skip
        arms = np.array([[(-1, 0, 0), (1, 0, 0)], [(0, -1, 0), (0, 1, 0)]])
        self.cross = scene.add_line_segments(
            f"{tip_path}/cross", cross * arms, paint.LINE, thickness=2.5, thickness_units="screen",
            position=(0.0, 0.0, self.top + 0.02 * self.reach),
        )  # fmt: skip
        self.show(pose)

    def show(self, pose: Pose) -> None:
        """Re-positions the camera where the tip has left its picture."""
        tip = pose.tip.place
        limits = 0.5 * TIP_MARGIN * self.reach * np.array(PICTURE)
        if np.all(np.abs(tip[:2] - self.centre) <= limits):
            return
        self.centre = tip[:2].copy()
        self.frame.position = (tip[0], tip[1], tip[2] + self.top)
