"""The arm in 3-D: the live model, a mode in motion, or a played recording with its error in the
arm's colours and on a board."""

from __future__ import annotations

import threading
import time

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.jobs.inbox import THREADS
from flexgui.page.layout import Widths, Window, aspect, covered
from flexgui.page.panel import PageContext, PageElement
from flexgui.scene.arm_scene import ArmScene
from flexgui.scene.error_board import NAME, ErrorBoard, error_paint
from flexgui.scene.paint import HOME, lowered
from flexgui.scene.recorded_motion import RecordedMotion
from flexgui.session.session import Session
from flexgui.session.state import LiveSettings, Topic
from flexgui.stages.arm.live import LiveModel
from flexgui.stages.compare.state import WhereItFails

ASPECT = 0.68
"""Width over height of the picture on a usual screen; in a narrower one the camera is farther."""

DOWN = 1.2
"""Share of the reach by which the view is moved on a phone, where panels cover the lower part."""

SETTLING = 5.0
"""s after the camera was set in which the browser may still report its old place, which must not
count as a turn by hand."""

TURNED = 1e-3
"""Share of the reach: a camera farther from its place was moved by a person."""

SWINGS_PER_SECOND = 0.6
"""A mode is played slowly; its true frequency is shown beside it."""

FRAMES_PER_SECOND = 25.0
OTHER_SIZE = 1.5
"""For an arm larger or smaller by this factor the camera is set again."""

DRAWN = frozenset({
    Topic.LIVE, Topic.STAGE, Topic.CURSOR, Topic.RECORDINGS, Topic.OUTCOME, Topic.DIAGNOSIS,
})  # fmt: skip


class ScenePanel(PageElement):
    """Shows the arm of one page; built with the first live model, later only moved."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._stage: ArmScene | None = None
        self._shown: object = None
        self._drawn_measured: tuple[float, bool] | None = None
        """Factor of the drawn distance between measured arm and model, and whether the arm is only
        an example."""
        self._errors = ErrorsInScene(context)
        self._reach = 1.0
        self._window, self._side = Window(), HOME
        self._aimed_at = 0.0
        """Time (monotonic) at which the camera was set."""
        self._eye = np.zeros(3)
        """Where the camera was put, (3,) m."""
        self._lock = threading.RLock()
        self._closed = threading.Event()
        self._swings = False
        context.theme.callbacks.append(self.set_dark)

    def draw(self, topics: frozenset[Topic]) -> None:
        """Draws the changes of the session."""
        session = self.session
        view, motion = session.document.live_model, session.playback.motion
        if view is None or not topics & DRAWN:
            return
        with self._lock:
            stage = self._arm_scene(view)
            factor = exaggeration(session)
            if stage.exaggeration != factor:
                stage.exaggeration = factor
            if motion is None or not plays(session):
                self._show_live(stage, view)
            else:
                self._show_recording(stage, motion)
            if topics & {Topic.RECORDINGS, Topic.STAGE}:
                stage.show_camera(has_camera(session))
            self._errors.draw(stage, self._window.phone)
            if session.document.live.mode is not None and not self._swings:
                self._swings = True
                THREADS.run(self._swing)

    def _arm_scene(self, view: LiveModel) -> ArmScene:
        if self._stage is None:
            self._stage = ArmScene(
                self.context.client, view.model.arm, view.numbers.p, view.q, self._window.gpu
            )
            self._stage.set_dark(self.context.theme.dark)
            self._stage.show_camera(has_camera(self.session))
            self._aim(self._stage)
        return self._stage

    def fit(self, window: Window, shares: Widths) -> None:
        """Keeps the whole arm in view when the picture's shape changes."""
        with self._lock:
            before, self._window = self._window, window
            if self._stage is None or aspect(before) == aspect(window):
                return
            if self._is_aimed() or time.monotonic() - self._aimed_at < SETTLING:
                self._aim(self._stage)

    def look_from(self, side: str) -> None:
        """Looks from one of DIRECTIONS at the whole arm."""
        with self._lock:
            if self._stage is not None:
                self._side = side
                self._aim(self._stage)

    def _is_aimed(self) -> bool:
        """Whether nobody has turned the view since the camera was set."""
        moved = self.context.client.camera.position - self._eye
        return bool(np.linalg.norm(moved) < TURNED * self._reach)

    def _aim(self, stage: ArmScene) -> None:
        """Sets the camera for the whole arm; a view turned by hand stays until the next arm."""
        self._reach, self._aimed_at = stage.body.reach, time.monotonic()
        camera, phone = self.context.client.camera, self._window.phone
        eye = stage.view(min(aspect(self._window), ASPECT), self._side)
        # Panels cover the lower part: the arm goes up, the aim down.
        if phone:
            down = np.array([0.0, -DOWN, 0.0]) * self._reach
        else:
            down = lowered(eye, covered(self._window))
        self._eye = eye.position + down
        camera.up_direction, camera.fov = eye.up, eye.fov
        camera.position, camera.look_at = self._eye, eye.look_at + down

    def _rebuild(self, stage: ArmScene, arm: Arm, p: np.ndarray, q: np.ndarray) -> None:
        stage.rebuild(arm, p, q)
        if not 1.0 / OTHER_SIZE < stage.body.reach / self._reach < OTHER_SIZE:
            self._aim(stage)

    def _show_live(self, stage: ArmScene, view: LiveModel) -> None:
        if self._shown is view:
            return
        self._shown = view
        self._rebuild(stage, view.model.arm, view.numbers.p, view.q)

    def _show_recording(self, stage: ArmScene, motion: RecordedMotion) -> None:
        cursor = self.session.playback.cursor
        fresh = self._shown is not motion
        aims = fresh and self._is_aimed()
        if fresh:
            self._shown, self._drawn_measured = motion, None
            self._rebuild(stage, motion.arm, motion.motion.p, motion.motion.q[0])
        drawn = (cursor.error, self.session.recordings.rig.is_asked)
        if self._drawn_measured != drawn:
            self._drawn_measured = drawn
            stage.show_paths(motion.motion.q, measured_arm(self.session, motion))
        if aims:
            self._aim(stage)
        k, ghost = motion.frame(cursor.time), measured_arm(self.session, motion)
        stage.show(motion.motion.q[k], None if ghost is None else ghost[k])

    def set_dark(self, dark: bool) -> None:
        """Sets the colours of floor and errors for a dark or light page."""
        with self._lock:
            if self._stage is not None:
                self._stage.set_dark(dark)
                self._errors.draw(self._stage, self._window.phone)

    def _swing(self) -> None:
        """Moves the chosen mode while the first stage is shown; ends without a chosen mode."""
        session = self.session
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
        """Stops the motion of a mode."""
        self._closed.set()


COLOURED = ("Compare", "Diagnose")
"""Stages in which the arm shows its error."""

BOARD = "Compare"


class ErrorsInScene(PageElement):
    """Draws the error in the arm's colours and on a board; again for new nodes."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._plain = ""
        """The nodes on which no error is drawn."""
        self._painted: object = None
        self._board: ErrorBoard | None = None
        self._board_of: tuple[object, object] = (None, ())
        self._dark = False

    def draw(self, stage: ArmScene, phone: bool) -> None:
        """Shows the error at the cursor; on a `phone` no board, whose cells no finger would hit."""
        session = self.session
        failing = session.comparison.failing if session.stage in COLOURED else None
        self._dark = self.context.theme.dark
        plain = stage.anchor("base") if failing is None else ""
        if plain and plain == self._plain:
            return
        self._plain = plain
        self._paint(stage, None if failing is None else session.comparison.on_arm)
        shown = session.stage == BOARD and not phone
        self._show_board(stage, failing if shown else None)

    def _paint(self, stage: ArmScene, failing: WhereItFails | None) -> None:
        cursor, joints = self.session.playback.cursor, stage.body.arm.joints
        along = None if failing is None else failing.now.get(cursor.recording)
        worst = 1.0 if failing is None else self.session.comparison.worst_error
        now = {} if along is None else along.at(cursor.time)
        colours = error_paint(now, joints, worst, self._dark)
        key = (colours, stage.anchor("base"))
        if key != self._painted:
            self._painted = key
            stage.paint(colours.beams, colours.hubs)

    def _show_board(self, stage: ArmScene, failing: WhereItFails | None) -> None:
        board = None if failing is None else failing.board
        made_of = (board, (stage.anchor("base"), self._dark, round(stage.front, 2)))
        if made_of[0] is not self._board_of[0] or made_of[1] != self._board_of[1]:
            self._board_of = made_of
            self._board = None
            stage.detach(NAME)
            if board is not None:
                pick = None if self.context.read_only else self._picked
                # In a narrow picture there is little room beside the board.
                names = [name.removeprefix("θ2 = ") for name in board.recordings]
                self._board = ErrorBoard(
                    stage, self.context.client, board.ratio, names, pick, self._dark
                )
        cursor = self.session.playback.cursor
        if board is not None and self._board is not None and cursor.recording in board.recordings:
            row = board.recordings.index(cursor.recording)
            self._board.mark(row, cursor.time / float(board.edges[-1]))

    def _picked(self, row: int, column: int) -> None:
        """Moves arm, time-line and plots to the time and recording of a cell."""
        session = self.session
        board = None if session.comparison.failing is None else session.comparison.failing.board
        if board is None or row >= len(board.recordings) or column + 1 >= len(board.edges):
            return
        middle = 0.5 * float(board.edges[column] + board.edges[column + 1])
        session.playback.move(recording=board.recordings[row], time=middle, playing=False)


BEFORE = LiveSettings().exaggeration
"""The slider's initial value."""


def plays(session: Session) -> bool:
    """Whether the scene shows the recording instead of the live model."""
    return session.stage != "Arm" and session.playback.motion is not None


def exaggeration(session: Session) -> float:
    """The factor by which bending is drawn larger now."""
    chosen, motion = session.document.live.exaggeration, session.playback.motion
    if session.recordings.rig.is_asked and plays(session):
        return 1.0  # by the lengths of an example a bending means nothing
    if motion is None or not plays(session) or chosen != BEFORE:
        return chosen
    return motion.exaggeration


def measured_arm(session: Session, motion: RecordedMotion) -> np.ndarray | None:
    """(K, n) the measured postures as they are drawn; None where the arm is only an example, whose
    lengths the measured tip does not fit."""
    if session.recordings.rig.is_asked:
        return None
    return motion.exaggerated_ghost(session.playback.cursor.error)


def has_camera(session: Session) -> bool:
    """Whether a camera is drawn: the recording has camera channels. This is not known before a file
    is read; simulated recordings have a camera."""
    if session.playback.recording is not None:
        return session.playback.recording.has("z1", "z2")
    return all(spec.simulate is not None for spec in session.document.scenario.recordings)


def legend(session: Session) -> str:
    """The legend of the scene; empty without a recording."""
    motion = session.playback.motion
    if motion is None or not plays(session):
        return ""
    if session.recordings.rig.is_asked:
        return "Your arm is drawn once you have stated your rig."
    arms = () if motion.ghost is None else ("solid: model", "translucent: measured")
    factor, apart = exaggeration(session), session.playback.cursor.error
    bending = (f"bending ×{factor:g}",) if motion.arm.coordinates > motion.arm.joints else ()
    error = (f"error ×{apart:g}",) if motion.ghost is not None and apart > 1.0 else ()
    return ", ".join((*arms, *bending, *error))
