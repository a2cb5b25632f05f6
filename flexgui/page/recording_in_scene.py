"""What the scene draws of a recording: how much larger the bending, the error in the colours of the
arm, and its map as a board."""

from __future__ import annotations

from collections.abc import Sequence

from flexgui.page.panel import PageContext
from flexgui.scene.error_board import NAME, ErrorBoard, error_paint
from flexgui.scene.scene import Stage
from flexgui.session import Session
from flexgui.session.state import Live
from flexgui.stages.compare.state import WhereItFails

COLOURED = ("Compare", "Diagnose")
"""Stages in which the arm shows its error."""

BOARD = "Compare"


class ErrorsInScene:
    """Drawn on whatever stage there is; anew where its nodes are new."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._painted: object = None
        self._board: ErrorBoard | None = None
        self._made_of: tuple[object, str] = (None, "")

    def draw(self, stage: Stage) -> None:
        """Shows the error at the cursor."""
        session = self._context.session
        found = session.comparison.failing if session.stage in COLOURED else None
        self._paint(stage, found)
        self._show_board(stage, found if session.stage == BOARD else None)

    def _paint(self, stage: Stage, found: WhereItFails | None) -> None:
        cursor, joints = self._context.session.playback.cursor, stage.body.arm.joints
        along = None if found is None else found.now.get(cursor.recording)
        worst = 1.0 if found is None else self._context.session.comparison.worst_error
        colours = error_paint({} if along is None else along.at(cursor.time), joints, worst)
        key = (colours, stage.anchor("base"))
        if key != self._painted:
            self._painted = key
            stage.paint(colours.beams, colours.hubs)

    def _show_board(self, stage: Stage, found: WhereItFails | None) -> None:
        board = None if found is None else found.board
        made_of = (board, stage.anchor("base"))
        if made_of[0] is not self._made_of[0] or made_of[1] != self._made_of[1]:
            self._made_of = made_of
            self._board = None
            stage.detach(NAME)
            if board is not None:
                pick = None if self._context.read_only else self._picked
                owner = self._context.client
                self._board = ErrorBoard(stage, owner, board.ratio, _short(board.recordings), pick)
        cursor = self._context.session.playback.cursor
        if board is not None and self._board is not None and cursor.recording in board.recordings:
            row = board.recordings.index(cursor.recording)
            self._board.mark(row, cursor.time / float(board.edges[-1]))

    def _picked(self, row: int, column: int) -> None:
        """Arm, time-line and plots go to the cell."""
        session = self._context.session
        board = None if session.comparison.failing is None else session.comparison.failing.board
        if board is None or row >= len(board.recordings) or column + 1 >= len(board.edges):
            return
        middle = 0.5 * float(board.edges[column] + board.edges[column + 1])
        session.playback.move(recording=board.recordings[row], time=middle, playing=False)


def _short(names: Sequence[str]) -> list[str]:
    """Of recordings, as they stand beside the board: in a narrow picture there is little room."""
    return [name.removeprefix("θ2 = ") for name in names]


BEFORE = Live().exaggeration
"""Where the slider stands until somebody moves it."""


def plays(session: Session) -> bool:
    """Whether the scene shows the recording and not the arm of the sliders."""
    return session.stage != "Arm" and session.playback.motion is not None


def exaggeration(session: Session) -> float:
    """Of what the scene shows now."""
    chosen, motion = session.document.live.exaggeration, session.playback.motion
    if motion is None or not plays(session) or chosen != BEFORE:
        return chosen
    return motion.exaggeration


def has_camera(session: Session) -> bool:
    """Whether a camera is drawn: only where the recording holds what one saw. What a file holds is
    not known before it was read; simulated recordings have a camera."""
    if session.playback.recording is not None:
        return session.playback.recording.has("z1", "z2")
    return all(spec.simulate is not None for spec in session.document.scenario.recordings)


def legend(session: Session) -> str:
    """What is what in the scene, in words; empty where it shows no recording."""
    motion = session.playback.motion
    if motion is None or not plays(session):
        return ""
    arms = () if motion.ghost is None else (
        "Solid: model.", "Translucent: measured.", "Line at the tip: error."
    )  # fmt: skip
    factor = exaggeration(session)
    bends = motion.arm.coordinates > motion.arm.joints
    bending = f"Bending drawn ×{factor:g}." if factor > 1.0 else "Bending drawn as it is."
    larger = motion.ghost is not None and session.playback.cursor.error > 1.0
    error = (f"Error drawn ×{session.playback.cursor.error:g}.",) if larger else ()
    return " ".join((*arms, *((bending,) if bends else ()), *error))
