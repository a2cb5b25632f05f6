"""The joints' arcs and the angles written beside them."""

from __future__ import annotations

from viser import LabelHandle, MeshHandle, SceneApi

from flexgui.stage import paint
from flexgui.stage.pose import Body, JointMark, Pose, mark_faces

LABEL_SCALE = 1.25


class MarkNodes:
    """Built once; `show` moves what is there."""

    def __init__(self, scene: SceneApi, path: str, body: Body, pose: Pose) -> None:
        self.scene, self.path = scene, path
        marks = body.marks(pose)
        self.arcs: list[MeshHandle] = [self._arc(k, mark) for k, mark in enumerate(marks)]
        self.labels: list[LabelHandle] = [self._label(k, mark) for k, mark in enumerate(marks)]

    def show(self, body: Body, pose: Pose) -> None:
        """Moves arcs and labels, and writes the angles."""
        marks = body.marks(pose)
        for arc, label, mark in zip(self.arcs, self.labels, marks, strict=True):
            arc.vertices = mark.vertices
            label.position = mark.label
            label.text = mark.text

    def _arc(self, k: int, mark: JointMark) -> MeshHandle:
        return self.scene.add_mesh_simple(
            f"{self.path}/arc{k + 1}", mark.vertices, mark_faces(), color=paint.INK, side="double",
            cast_shadow=False, receive_shadow=False,
        )  # fmt: skip

    def _label(self, k: int, mark: JointMark) -> LabelHandle:
        return self.scene.add_label(
            f"{self.path}/label{k + 1}", mark.text, position=mark.label, anchor="center-center",
            font_screen_scale=LABEL_SCALE,
        )  # fmt: skip
