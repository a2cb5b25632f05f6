"""The stage: the arm in a viser scene, built once and then only moved, with the names of added
effects where they act."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from viser import FrameHandle, SceneNodeHandle

from flexgui.core.arm.arm import Arm
from flexgui.scene.arm_nodes import GHOST, MODEL, ArmNodes, CameraNodes, MarkNodes, PathNodes
from flexgui.scene.paint import HOME, ROOT, Owner, Rgb, View, add_floor, light, view_of
from flexgui.scene.pose import LIFT, Body, Pose

LEAST_EXAGGERATION, MOST_EXAGGERATION = 1.0, 50.0
FAINT = 0.14
"""Opacity of the ghost while the model under it shows something in its colours."""

GROUPS = ("model", "ghost", "angles", "camera", "paths")


@dataclass
class Attachment:
    """Something drawn on the arm; `follow` is called with each new pose."""

    handles: tuple[SceneNodeHandle, ...]
    follow: Callable[[Pose], None] | None = None


class Stage:
    """The arm, its measured ghost, tip paths and camera.

    Nodes are made once. What moves later is set in place within one atomic block: adding a name
    again would drop the page to a few frames per second.
    """

    def __init__(
        self,
        owner: Owner,
        arm: Arm,
        p: np.ndarray,
        q: np.ndarray | None = None,
        fine: bool = False,
    ) -> None:
        """`fine`: shadows and reflections; without a graphics card they cost most of the time."""
        self._owner, self._fine = owner, fine
        light(owner.scene, fine)
        self._lock = threading.RLock()
        self._exaggeration = LEAST_EXAGGERATION
        self._attached: dict[str, Attachment] = {}
        self._shown = dict.fromkeys(GROUPS, True)
        self._generation, self._dark = 0, False
        self._ghost_q: np.ndarray | None = None
        self._motions: tuple[np.ndarray | None, np.ndarray | None] = (None, None)
        self._build(arm, p, np.zeros(arm.coordinates) if q is None else np.asarray(q, dtype=float))

    def show(self, q: np.ndarray) -> None:
        """The model's posture q (n,)."""
        with self._lock, self._owner.atomic():
            self._q = np.array(q, dtype=float)
            self._show_model()

    def show_ghost(self, q: np.ndarray | None) -> None:
        """The measured posture q (n,), translucent over the model; None hides it."""
        with self._lock, self._owner.atomic():
            self._ghost_q = None if q is None else np.array(q, dtype=float)
            self._show_ghost()

    def show_both(self, q: np.ndarray, ghost: np.ndarray | None) -> None:
        """Model and measurement of one sample."""
        with self._lock, self._owner.atomic():
            self._q = np.array(q, dtype=float)
            self._ghost_q = None if ghost is None else np.array(ghost, dtype=float)
            self._show_model()
            self._show_ghost()

    def show_paths(self, model: np.ndarray | None, measured: np.ndarray | None = None) -> None:
        """Tip paths of motions q (N, n) of the same samples; None hides a path."""
        with self._lock, self._owner.atomic():
            self._motions = (model, measured)
            self._show_paths()

    @property
    def exaggeration(self) -> float:
        """How often larger than true the bending is drawn, 1 to 50."""
        return self._exaggeration

    @exaggeration.setter
    def exaggeration(self, value: float) -> None:
        with self._lock, self._owner.atomic():
            self._exaggeration = float(np.clip(value, LEAST_EXAGGERATION, MOST_EXAGGERATION))
            self._show_all()

    def set_visible(self, **groups: bool) -> None:
        """Shows or hides whole groups: model, ghost, angles, camera, paths."""
        with self._lock, self._owner.atomic():
            for name, visible in groups.items():
                if self._shown[name] == visible:
                    continue
                self._shown[name] = visible
                self._groups[name].visible = visible
            self._ghost_group.visible = self._shown["ghost"] and self._ghost_q is not None
            self.camera.cross.visible = self._shown["camera"]

    def set_dark(self, dark: bool) -> None:
        """Lines of the floor that suit the page's ground; all else is readable on both."""
        with self._lock, self._owner.atomic():
            self._dark = dark
            self._floor.set_dark(dark)

    def rebuild(self, arm: Arm, p: np.ndarray, q: np.ndarray | None = None) -> None:
        """Another arm or other numbers; nodes are made anew only for another kind of arm."""
        with self._lock, self._owner.atomic():
            posture = self._fitting(arm, q)
            # The same arm at another posture, as a slider of a joint asks for all the time.
            if self._same_arm(arm, p):
                self._q = posture
                self._show_model()
                self._show_ghost()
                return
            if self._same_nodes(arm):
                self.body = Body(arm, p)
                self._q = posture
                self._forget_motions_of(arm)
                self.model.rebuild(self.body)
                self._show_all()
                return
            self._root.remove()
            self._floor.remove()
            self._attached.clear()
            self._build(arm, p, posture)

    def anchor(self, place: str) -> str:
        """Path of a place that moves with the arm: nodes added under it follow by themselves.

        'base', 'joint1', 'origin1' (before the joint turns), 'end1', 'tip' or 'camera'; x points
        along the segment, z up.
        """
        ends = {"tip": self.model.ends[-1].name, "camera": self.camera.frame.name}
        return {"base": self._root.name, **ends}.get(place, f"{self._root.name}/model/{place}")

    def attach(
        self,
        name: str,
        *handles: SceneNodeHandle,
        follow: Callable[[Pose], None] | None = None,
    ) -> None:
        """Keeps nodes that draw something (an effect, say) under a name, instead of older ones.

        `follow(pose)` is called now and with each new pose of the model.
        """
        with self._lock, self._owner.atomic():
            self.detach(name)
            self._attached[name] = Attachment(handles, follow)
            if follow is not None:
                follow(self._pose)

    def detach(self, name: str) -> None:
        """Removes what was attached under a name, if anything."""
        with self._lock:
            old = self._attached.pop(name, None)
            for handle in old.handles if old else ():
                handle.remove()

    def paint(self, beams: Sequence[Rgb | None], hubs: Sequence[Rgb | None]) -> None:
        """Colours of the model's parts, None: as usual."""
        with self._lock, self._owner.atomic():
            self.model.paint(beams, hubs)
            coloured = any(colour is not None for colour in beams)
            self.ghost.fade(FAINT if coloured else GHOST.opacity)

    @property
    def pose(self) -> Pose:
        """The model's pose as shown."""
        return self._pose

    def view(self, aspect: float = 1.3, side: str = HOME) -> View:
        """A good place to look from, for a canvas `aspect` times as wide as it is high."""
        return view_of(self.body.reach, aspect, side, self._places())

    def _places(self) -> np.ndarray:
        """(k, 3) m of the base, the posture's parts, rails and the tips of the motions."""
        spots = [spot.place for spot in (*self._pose.joints, *self._pose.ends)]
        spots += self.body.rail_ends(self._pose)
        tips = [self.body.tip_points(q, 1.0) for q in self._motions if q is not None]
        return np.concatenate([np.zeros((1, 3)), np.array(spots), *tips])

    def _build(self, arm: Arm, p: np.ndarray, q: np.ndarray) -> None:
        self.body = Body(arm, p)
        self._q, self._ghost_q = q, None
        self._motions = (None, None)
        self._pose = self.body.pose(q, self._exaggeration)
        scene, path = self._owner.scene, f"{ROOT}{self._generation or ''}"
        self._generation += 1
        with self._owner.atomic():
            scene.set_up_direction("+z")
            self._root = scene.add_frame(path, show_axes=False)
            self._groups: dict[str, FrameHandle] = {
                name: scene.add_frame(f"{path}/{name}", show_axes=False, visible=self._shown[name])
                for name in GROUPS
            }
            self._floor = add_floor(scene, f"{path}_floor", self.body.reach, self._dark, self._fine)
            self.model = ArmNodes(scene, f"{path}/model", self.body, MODEL, self._pose)
            ghost_pose = self.body.pose(q, self._exaggeration, GHOST.grown)
            self.ghost = ArmNodes(scene, f"{path}/ghost", self.body, GHOST, ghost_pose)
            self.marks = MarkNodes(scene, f"{path}/angles", self.body, self._pose)
            tip = self.model.ends[-1].name
            self.camera = CameraNodes(scene, f"{path}/camera", self.body, self._pose, tip)
            lift = 0.5 * self.body.sections[-1].height + LIFT * self.body.reach
            self.paths = PathNodes(scene, f"{path}/paths", lift)
            self._ghost_group.visible = False

    @property
    def _ghost_group(self) -> FrameHandle:
        return self._groups["ghost"]

    def _same_arm(self, arm: Arm, p: np.ndarray) -> bool:
        return self.body.arm is arm and np.array_equal(self.body.p, p)

    def _same_nodes(self, arm: Arm) -> bool:
        now = [(s.joint, s.mount) for s in self.body.arm.segments]
        return now == [(s.joint, s.mount) for s in arm.segments]

    def _fitting(self, arm: Arm, q: np.ndarray | None) -> np.ndarray:
        """q where given; else the joints as they stand, straight if the modes have changed."""
        if q is not None:
            return np.asarray(q, dtype=float)
        out = np.zeros(arm.coordinates)
        count = min(arm.joints, self.body.arm.joints)
        out[:count] = self._q[:count]
        return self._q if arm.modes == self.body.arm.modes else out

    def _forget_motions_of(self, arm: Arm) -> None:
        """Motions of an arm with other coordinates cannot be drawn with this one."""
        n = arm.coordinates
        if self._ghost_q is not None and len(self._ghost_q) != n:
            self._ghost_q = None
        if any(m is not None and m.shape[1] != n for m in self._motions):
            self._motions = (None, None)

    def _show_all(self) -> None:
        self._show_model()
        self._show_ghost()
        self._show_paths()

    def _show_model(self) -> None:
        self._pose = self.body.pose(self._q, self._exaggeration)
        self.model.show(self._pose)
        self.marks.show(self.body, self._pose)
        self.camera.show(self._pose)
        for attachment in self._attached.values():
            if attachment.follow is not None:
                attachment.follow(self._pose)

    def _show_ghost(self) -> None:
        self._ghost_group.visible = self._shown["ghost"] and self._ghost_q is not None
        if self._ghost_q is None:
            self.paths.show_error(self._pose.tip.place, None)
            return
        pose = self.body.pose(self._ghost_q, self._exaggeration, GHOST.grown)
        self.ghost.show(pose)
        self.paths.show_error(self._pose.tip.place, pose.tip.place)

    def _show_paths(self) -> None:
        tips = [
            None if q is None else self.body.tip_points(q, self._exaggeration)
            for q in self._motions
        ]
        self.paths.show(*tips)


NAME = "effects"
"""Under which they are attached."""

RISE, APART = 0.21, 0.07
"""Of the arm's reach: how high the first stands over its place, and the next over it."""

SCALE = 1.1


@dataclass(frozen=True)
class Drawn:
    """One effect to write."""

    title: str
    place: str
    """As effects state it: joints, tip, segments, base, camera or drive."""


def show_effects(stage: Stage, owner: Owner, effects: Sequence[Drawn]) -> None:
    """Writes them instead of what was written before."""
    reach, taken, handles = stage.body.reach, dict[str, int](), []
    joints = stage.body.arm.joints
    stage.detach(NAME)  # first: the new ones may have the same names
    for k, one in enumerate(effects):
        for place in _anchors(one.place, joints):
            level = taken.get(place, 0)
            taken[place] = level + 1
            handles.append(
                owner.scene.add_label(
                    f"{stage.anchor(place)}/effect{k}", f"+ {one.title}",
                    position=(0.0, 0.0, (RISE + APART * level) * reach),
                    font_screen_scale=SCALE,
                )
            )  # fmt: skip
    stage.attach(NAME, *handles)


def _anchors(place: str, joints: int) -> list[str]:
    """Names of the stage's places; a segment is written at its end."""
    each = {
        "joints": [f"origin{k + 1}" for k in range(joints)],
        "drive": ["origin1"],
        "segments": [f"end{k + 1}" for k in range(joints)],
        "tip": ["tip"],
        "camera": ["camera"],
    }
    return each.get(place, ["base"])
