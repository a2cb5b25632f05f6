"""The arm in the middle: the live model, a mode that swings, or a recording that plays."""

from __future__ import annotations

import threading
import time

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.jobs.inbox import CREW
from flexgui.page.layout import Widths, Window, aspect, covered
from flexgui.page.panel import PageContext
from flexgui.page.recording_in_scene import ErrorsInScene, exaggeration, has_camera, plays
from flexgui.scene.paint import HOME, lowered
from flexgui.scene.recorded import Playback
from flexgui.scene.scene import Drawn, Stage, show_effects
from flexgui.session import Topic
from flexgui.stages.arm.live import LiveModel
from flexgui.stages.diagnose.effects import places

ASPECT = 0.68
"""Width over height of what the panels leave of a usual screen; a narrower one is looked at from
further away."""

DOWN = 1.2
"""Of the arm's reach: on a phone the panels lie over the lower part of the arm's picture."""

SETTLING = 5.0
"""s after the camera was put, in which the browser may still report where it was before: what looks
like a turn by hand is none."""

TURNED = 1e-3
"""Of the reach: a camera further from its place was moved by a person."""

SWINGS_PER_SECOND = 0.6
"""A mode is played so slowly that the eye follows; its true frequency stands beside it."""

FRAMES_PER_SECOND = 25.0
OTHER_SIZE = 1.5
"""An arm that is so many times larger or smaller is looked at anew."""

DRAWN = frozenset(
    {
        Topic.LIVE,
        Topic.STAGE,
        Topic.CURSOR,
        Topic.RECORDINGS,
        Topic.OUTCOME,
        Topic.DIAGNOSIS,
    }
)


class Scene:
    """Made with the first live model; only moved after that."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._stage: Stage | None = None
        self._shown: object = None
        self._written: object = None
        self._apart = 0.0
        """How many times too far from the model the measured arm's path is drawn."""
        self._errors = ErrorsInScene(context)
        self._reach = 1.0
        self._window, self._side = Window(), HOME
        self._aimed = 0.0
        """When that was, by the monotonic clock."""
        self._was_aimed = False
        self._eye = np.zeros(3)
        """Where the camera was put, (3,) m."""
        self._lock = threading.RLock()
        self._closed = threading.Event()
        self._swings = False
        context.theme.followers.append(self.set_dark)

    def draw(self, topics: frozenset[Topic]) -> None:
        """Shows what the session says now."""
        session = self._context.session
        view, motion = session.document.view, session.playback.motion
        if view is None or not topics & DRAWN:
            return
        with self._lock:
            stage = self._made(view)
            factor = exaggeration(session)
            if stage.exaggeration != factor:
                stage.exaggeration = factor
            if motion is None or not plays(session):
                self._show_live(stage, view)
            else:
                self._show_recording(stage, motion)
            stage.show_camera(has_camera(session))
            self._show_effects(stage)
            self._errors.draw(stage)
            if session.document.live.mode is not None and not self._swings:
                self._swings = True
                CREW.run(self._swing)

    def _show_effects(self, stage: Stage) -> None:
        """What was added to the model, where it acts; anew where the arm's nodes were."""
        key = (places(self._context.session.document.scenario), stage.anchor("base"))
        if key != self._written:
            self._written = key
            show_effects(stage, self._context.client, [Drawn(*each) for each in key[0]])

    def _made(self, view: LiveModel) -> Stage:
        if self._stage is None:
            self._stage = Stage(
                self._context.client, view.model.arm, view.numbers.p, view.q, self._window.gpu
            )
            self._stage.set_dark(self._context.theme.dark)
            self._aim(self._stage)
        return self._stage

    def fit(self, window: Window, shares: Widths) -> None:
        """The whole arm stays in sight in a picture of another shape."""
        with self._lock:
            before, self._window = self._window, window
            if self._stage is None or aspect(before) == aspect(window):
                return
            if self._is_aimed() or time.monotonic() - self._aimed < SETTLING:
                self._aim(self._stage)

    def look_from(self, side: str) -> None:
        """Of the stage's directions; the whole arm comes into sight."""
        with self._lock:
            if self._stage is not None:
                self._side = side
                self._aim(self._stage)

    def _is_aimed(self) -> bool:
        """Whether nobody has turned the view since."""
        moved = self._context.client.camera.position - self._eye
        return bool(np.linalg.norm(moved) < TURNED * self._reach)

    def _aim(self, stage: Stage) -> None:
        """Looks at the whole arm; what a person turns stays so until another arm comes."""
        self._reach, self._aimed = stage.body.reach, time.monotonic()
        camera, phone = self._context.client.camera, self._window.phone
        eye = stage.view(min(aspect(self._window), ASPECT), self._side)
        # Panels cover the lower part: the arm goes up, the aim down.
        if phone:
            down = np.array([0.0, -DOWN, 0.0]) * self._reach
        else:
            down = lowered(eye, covered(self._window))
        self._eye = eye.position + down
        camera.up_direction, camera.fov = eye.up, eye.fov
        camera.position, camera.look_at = self._eye, eye.look_at + down

    def _rebuild(self, stage: Stage, arm: Arm, p: np.ndarray, q: np.ndarray) -> None:
        stage.rebuild(arm, p, q)
        if not 1.0 / OTHER_SIZE < stage.body.reach / self._reach < OTHER_SIZE:
            self._aim(stage)

    def _show_live(self, stage: Stage, view: LiveModel) -> None:
        if self._shown is view:
            return
        self._shown = view
        self._rebuild(stage, view.model.arm, view.numbers.p, view.q)

    def _show_recording(self, stage: Stage, motion: Playback) -> None:
        cursor = self._context.session.playback.cursor
        fresh = self._shown is not motion
        if fresh:
            self._was_aimed = self._is_aimed()
            self._shown, self._apart = motion, 0.0
            self._rebuild(stage, motion.arm, motion.motion.p, motion.motion.q[0])
        if self._apart != cursor.error:
            self._apart = cursor.error
            stage.show_paths(motion.motion.q, motion.apart(cursor.error))
        if fresh and self._was_aimed:
            self._aim(stage)
        k, ghost = motion.frame(cursor.time), motion.apart(cursor.error)
        stage.show(motion.motion.q[k], None if ghost is None else ghost[k])

    def set_dark(self, dark: bool) -> None:
        """The floor suits the page's ground."""
        with self._lock:
            if self._stage is not None:
                self._stage.set_dark(dark)

    def _swing(self) -> None:
        """Swings the chosen mode while the first stage is shown; nobody waits where none is."""
        session = self._context.session
        while not self._closed.wait(1.0 / FRAMES_PER_SECOND):
            with self._lock:
                mode, view, stage = session.document.live.mode, self._shown, self._stage
                if mode is None:
                    self._swings = False
                    return
                if stage is None or not isinstance(view, LiveModel) or session.stage != "Arm":
                    continue
                if mode < len(view.modes):
                    turn = np.exp(2j * np.pi * SWINGS_PER_SECOND * time.monotonic())
                    stage.show(view.at.q + np.real(turn * view.modes[mode].vector))

    def close(self) -> None:
        """Nothing swings any more."""
        self._closed.set()
