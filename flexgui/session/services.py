"""What a page gets from the server."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from flexgui.classroom.board import Board
from flexgui.jobs import JobPool


class Services(Protocol):
    """Shared by all sessions."""

    @property
    def pool(self) -> JobPool:
        """Where long work is done."""

    @property
    def data_folder(self) -> Path | None:
        """Where the recordings of ready-made scenarios lie; None where nobody said."""

    @property
    def upload_limit_bytes(self) -> int:
        """The largest upload, bytes."""

    @property
    def board(self) -> Board:
        """Who found what in the challenges of this server."""
