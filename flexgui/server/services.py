"""What a page gets from the server."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from flexgui.server.limits import Limits

if TYPE_CHECKING:
    from viser import ClientHandle

    from flexgui.classroom.board import Board
    from flexgui.jobs import JobPool

TEACHER, FOLLOWER, OWN = "teacher", "follower", "own"


class DemoStage(Protocol):
    """A demo: one session that many look at."""

    def role(self, client: ClientHandle) -> str:
        """ "teacher", "follower" (sees the teacher's session, may change nothing) or "own"."""


@dataclass(frozen=True)
class Services:
    """Shared by all sessions."""

    pool: JobPool
    data_folder: Path | None = None
    """Where the recordings of ready-made scenarios lie; None where nobody said."""
    upload_limit_bytes: int = Limits.upload_bytes
    demo: DemoStage | None = None
    log: logging.Logger = field(default_factory=lambda: logging.getLogger("flexgui"))

    @cached_property
    def board(self) -> Board:
        """Who found what in the challenges of this server."""
        from flexgui.classroom.board import Board  # late: the session's room takes long to load

        return Board()
