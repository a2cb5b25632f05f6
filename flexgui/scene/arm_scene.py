"""The arm in a viser scene, built once and then only moved."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np
from viser import FrameHandle, SceneNodeHandle

from flexgui.core.arm.arm import Arm
from flexgui.scene import paint
from flexgui.scene.arm_nodes import GHOST, MODEL, ArmNodes, CameraNodes, MarkNodes, PathNodes
from flexgui.scene.floor import Floor
from flexgui.scene.paint import HOME, ROOT, Owner, Rgb, View, light, view_of
from flexgui.scene.pose import LIFT, Body, Pose

LEAST_EXAGGERATION, MOST_EXAGGERATION = 1.0, 50.0

GROUPS = ("model", "ghost", "angles", "camera", "paths")


class ArmScene:
    """The arm, its measured ghost, tip paths and camera.

    Nodes are made once. What moves later is set in place within one atomic block: adding a name
    again would drop the page to a few frames per second.
    """

    body: Body
    pose: Pose
    """The model's, as shown."""
    floor: Floor
    model: ArmNodes
    ghost: ArmNodes
    marks: MarkNodes
    camera: CameraNodes
    paths: PathNodes
    _root: FrameHandle
    _groups: dict[str, FrameHandle]
    front: float
    """m, the smallest y of base, joints and tip in the motions that are shown."""
    _motions: tuple[np.ndarray | None, np.ndarray | None]

    def __init__(
        self,
        owner: Owner,
        arm: Arm,
        p: np.ndarray,
        q: np.ndarray | None = None,
        fine: bool = False,
    ) -> None:
        """`fine`: light is reflected; without a graphics card they cost most of the time."""
        self._owner = owner
        light(owner.scene, fine)
        self._lock = threading.RLock()
        self._exaggeration = LEAST_EXAGGERATION
        self._attached: dict[str, tuple[SceneNodeHandle, ...]] = {}
        self._generation, self._dark, self._has_camera = 0, False, True
        self._build(arm, p, np.zeros(arm.coordinates) if q is None else q)

    def show(self, q: np.ndarray, ghost: np.ndarray | None = None) -> None:
        """The model's posture q (n,), and the measured one `ghost` (n,) translucent over it."""
        with self._lock, self._owner.atomic():
            self._q, self._ghost_q = np.array(q, dtype=float), ghost
            self.pose = self.body.pose(self._q, self._exaggeration)
            self.model.show(self.pose)
            self.marks.show(self.body, self.pose)
            self.floor.show(self.body, self.pose)
            self.camera.show(self.pose)
            paint.switch(self._groups["ghost"], ghost is not None)
            tips = [self.pose.tip.place]
            if ghost is not None:
                ghost_pose = self.body.pose(ghost, self._exaggeration, GHOST.grown)
                self.ghost.show(ghost_pose)
                tips.append(ghost_pose.tip.place)
            self.paths.show_error(*tips)

    def show_paths(self, model: np.ndarray | None, measured: np.ndarray | None = None) -> None:
        """Tip paths of motions q (N, n), `model` and `measured`, of the same samples; None hides a
        path."""
        with self._lock, self._owner.atomic():
            self._motions = (model, measured)
            chosen = [q for q in self._motions if q is not None]
            self.front = min([0.0, *(self.body.front(q) for q in chosen)])
            self.paths.show(*(self._tips(q, self._exaggeration) for q in self._motions))

    def _tips(self, q: np.ndarray | None, exaggeration: float) -> np.ndarray | None:
        return None if q is None else self.body.tip_points(q, exaggeration)

    @property
    def exaggeration(self) -> float:
        """How many times larger than true the bending is drawn, 1 to 50."""
        return self._exaggeration

    @exaggeration.setter
    def exaggeration(self, value: float) -> None:
        with self._lock, self._owner.atomic():
            self._exaggeration = float(np.clip(value, LEAST_EXAGGERATION, MOST_EXAGGERATION))
            self.show(self._q, self._ghost_q)
            self.show_paths(*self._motions)

    def show_camera(self, visible: bool) -> None:
        """Whether there is one on the rig."""
        with self._lock, self._owner.atomic():
            self._has_camera = visible
            for node in (self._groups["camera"], self.camera.cross):
                paint.switch(node, visible)

    def set_dark(self, dark: bool) -> None:
        """Lines of the floor that suit the page's ground; all else is readable on both."""
        with self._lock, self._owner.atomic():
            self._dark = dark
            self.floor.set_dark(dark)

    def rebuild(self, arm: Arm, p: np.ndarray, q: np.ndarray) -> None:
        """Another arm or other numbers p (np,), at posture q (n,), without ghost and paths; nodes
        are made again only for another kind of arm."""
        with self._lock, self._owner.atomic():
            # The same arm at another posture, as a slider of a joint asks for all the time.
            same = self.body.arm is arm and np.array_equal(self.body.p, p)
            if not same and _kinds(self.body.arm) != _kinds(arm):
                self._root.remove()
                self.floor.remove()
                self._attached.clear()
                self._build(arm, p, q)
                return
            if not same:
                self.body = Body(arm, p)
                self.model.rebuild(self.body)
            self.show_paths(None)
            self.show(q)

    def anchor(self, place: str) -> str:
        """Path of a place that moves with the arm: nodes added under it follow by themselves.

        'base', 'joint1', 'origin1' (before the joint turns), 'end1', 'tip' or 'camera'; x points
        along the segment, z up.
        """
        ends = {"tip": self.model.ends[-1].name, "camera": self.camera.frame.name}
        return {"base": self._root.name, **ends}.get(place, f"{self._root.name}/model/{place}")

    def attach(self, name: str, *handles: SceneNodeHandle) -> None:
        """Keeps nodes that draw something (an effect, say) under a name, instead of older ones."""
        with self._lock, self._owner.atomic():
            self.detach(name)
            self._attached[name] = handles

    def detach(self, name: str) -> None:
        """Removes what was attached under a name, if anything."""
        with self._lock:
            for handle in self._attached.pop(name, ()):
                handle.remove()

    def paint(self, beams: Sequence[Rgb | None], hubs: Sequence[Rgb | None]) -> None:
        """Colours of the model's parts, None: as usual."""
        with self._lock, self._owner.atomic():
            self.model.paint(beams, hubs)

    def view(self, aspect: float = 1.3, side: str = HOME) -> View:
        """A good place to look from, for a canvas `aspect` times as wide as it is high: base,
        posture, rails and the tips of the motions are in sight."""
        spots = [spot.place for spot in (*self.pose.joints, *self.pose.ends)]
        spots += [np.zeros(3), *self.body.rail_ends(self.pose)]
        tips = [tips for q in self._motions if (tips := self._tips(q, 1.0)) is not None]
        return view_of(self.body.reach, aspect, side, np.concatenate([np.array(spots), *tips]))

    def _build(self, arm: Arm, p: np.ndarray, q: np.ndarray) -> None:
        self.body = Body(arm, p)
        self._motions, self.front = (None, None), 0.0
        pose, reach = self.body.pose(q, self._exaggeration), self.body.reach
        scene, path = self._owner.scene, f"{ROOT}{self._generation or ''}"
        self._generation += 1
        with self._owner.atomic():
            scene.set_up_direction("+z")
            self._root = scene.add_frame(path, show_axes=False)
            self._groups = {
                name: scene.add_frame(f"{path}/{name}", show_axes=False) for name in GROUPS
            }
            self.floor = Floor(scene, f"{path}_floor", self.body, pose, self._dark)
            self.model = ArmNodes(scene, f"{path}/model", self.body, MODEL, pose)
            ghost_pose = self.body.pose(q, self._exaggeration, GHOST.grown)
            self.ghost = ArmNodes(scene, f"{path}/ghost", self.body, GHOST, ghost_pose)
            self.marks = MarkNodes(scene, f"{path}/angles", self.body, pose)
            tip = self.model.ends[-1].name
            self.camera = CameraNodes(scene, f"{path}/camera", self.body, pose, tip)
            self.show_camera(self._has_camera)
            lift = 0.5 * self.body.sections[-1].height + LIFT * reach
            self.paths = PathNodes(scene, f"{path}/paths", lift)
            self.show(q)


def _kinds(arm: Arm) -> list[tuple[str, str]]:
    """What decides which nodes there are."""
    return [(segment.joint, segment.mount) for segment in arm.segments]
