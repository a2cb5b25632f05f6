"""What the server gives to the pages of all sessions, and how much it takes from a browser."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexgui.classroom.board import Board
    from flexgui.jobs import JobPool

MEGA = 10**6


@dataclass(frozen=True)
class Limits:
    """Sizes in bytes, times in seconds; the defaults suit a class of thirty on a laptop."""

    upload_bytes: int = 100 * MEGA
    """One file: an hour of ten channels at 1 kHz as text is about three times less."""
    session_bytes: int = 500 * MEGA
    """All files that a session keeps."""
    transfers: int = 8
    """Uploads of one connection at a time."""
    message_bytes: int = 16 * MEGA
    """Parts of an upload have 0.5 MB; the largest message is a picture of the stage."""
    text_length: int = 20_000
    """Characters of a text box."""
    messages_per_second: float = 300.0
    """A browser sends 20 per moved slider and 20 for the camera; beyond this it has to wait."""
    burst: int = 600
    connections: int = 200
    sessions: int = 100
    sessions_per_address: int = 64
    """A class of thirty behind one router, twice; the rest is left to other addresses."""
    keep: float = 3600.0
    """That a session is kept after its last browser left."""
    keep_untouched: float = 10.0
    """That one is kept in which nothing was done; a reload takes a second, and then finds the same
    as in a new one."""
    grace: float = 20.0
    """That its jobs go on: a reload takes a second, a laptop that changes its network ten."""
    give_up_after: float = 120.0
    """After which a session that nobody uses may be given up early for a newcomer."""
    key_wait: float = 6.0
    """For a browser to say which session is its own."""
    key_wait_longer: float = 30.0
    """And then once more, for as many browsers as `asked_longer`: where the machine is busy with
    other work, a page that was taken for a new one would not offer what was done before."""
    asked_longer: int = 4
    wrong_codes: int = 10
    """Wrong codes and tickets per minute and address, before it is told to wait."""
    ports: int = 20
    """Tried, from the wished one upwards."""


@dataclass(frozen=True)
class Services:
    """Shared by all sessions."""

    pool: JobPool
    data_folder: Path | None = None
    """Where the recordings of ready-made scenarios lie; None where nobody said."""
    upload_limit_bytes: int = Limits.upload_bytes

    @cached_property
    def board(self) -> Board:
        """Who found what in the challenges of this server."""
        from flexgui.classroom.board import Board  # late: the first challenge needs it

        return Board()
