"""The error in the scene: the arm in its colours, and its map as a board to click on."""

from __future__ import annotations

from collections.abc import Sequence

from flexgui.panels.page_context import PageContext
from flexgui.session.failing import WhereItFails
from flexgui.stage.error_board import NAME, ErrorBoard, error_paint
from flexgui.stage.scene import Stage

COLOURED = ("Compare", "Diagnose")
"""Stages in which the arm shows its error."""

BOARD = "Compare"


class ErrorsInScene:
    """Drawn on whatever stage there is; anew where its nodes are new."""

    def __init__(self, desk: PageContext) -> None:
        self._desk = desk
        self._painted: object = None
        self._board: ErrorBoard | None = None
        self._made_of: tuple[object, str] = (None, "")

    def draw(self, stage: Stage) -> None:
        """Shows the error at the cursor."""
        session = self._desk.session
        found = session.failing if session.stage in COLOURED else None
        self._paint(stage, found)
        self._show_board(stage, found if session.stage == BOARD else None)

    def _paint(self, stage: Stage, found: WhereItFails | None) -> None:
        cursor, joints = self._desk.session.cursor, stage.body.arm.joints
        along = None if found is None else found.now.get(cursor.recording)
        worst = 1.0 if found is None else self._desk.session.worst_error
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
                pick = None if self._desk.read_only else self._picked
                owner = self._desk.client
                self._board = ErrorBoard(stage, owner, board.ratio, _short(board.recordings), pick)
        cursor = self._desk.session.cursor
        if board is not None and self._board is not None and cursor.recording in board.recordings:
            row = board.recordings.index(cursor.recording)
            self._board.mark(row, cursor.time / float(board.edges[-1]))

    def _picked(self, row: int, column: int) -> None:
        """Arm, time-line and plots go to the cell."""
        session = self._desk.session
        board = None if session.failing is None else session.failing.board
        if board is None or row >= len(board.recordings) or column + 1 >= len(board.edges):
            return
        middle = 0.5 * float(board.edges[column] + board.edges[column + 1])
        session.set_cursor(recording=board.recordings[row], time=middle, playing=False)


def _short(names: Sequence[str]) -> list[str]:
    """Of recordings, as they stand beside the board: in a narrow picture there is little room."""
    return [name.removeprefix("θ2 = ") for name in names]
