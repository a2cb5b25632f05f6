"""What all sessions share, and the limits of the server."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexgui.jobs import JobPool
    from flexgui.stages.challenge.board import Board

MEGA = 10**6


@dataclass(frozen=True)
class Limits:
    """Limits of the server: sizes in bytes, times in seconds; for a class of 30 on a laptop."""

    upload_bytes: int = 100 * MEGA
    """One file: an hour of ten channels at 1 kHz as text is about three times less."""
    session_bytes: int = 500 * MEGA
    """All files that a session keeps, with those that are being uploaded in its windows."""
    upload_memory: int = 2000 * MEGA
    """All uploads under way: each is in memory until it is whole."""
    transfers: int = 8
    """Uploads of one session at a time."""
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
    """A session is kept this long after its last browser left."""
    keep_untouched: float = 10.0
    """The same for a session without any work; a reload takes a second."""
    grace: float = 20.0
    """Its jobs run on this long: a reload takes a second, a laptop that changes its network ten."""
    give_up_after: float = 120.0
    """After this an unused session may be closed early, to make place for a new one."""
    key_wait: float = 6.0
    """Wait for a browser to send the key of its session."""
    key_wait_longer: float = 30.0
    """Second wait, for at most `asked_longer` browsers: on a busy machine a late key would be lost,
    and the page would not offer the earlier work."""
    asked_longer: int = 4
    wrong_codes: int = 10
    """Wrong codes and tickets per minute and address, before it has to wait."""
    ports: int = 20
    """Ports that are tried, from the given one upwards."""


@dataclass(frozen=True)
class Services:
    """Shared by all sessions."""

    pool: JobPool
    data_folder: Path | None = None
    """Folder of the recordings of supplied scenarios; None if not given."""
    upload_limit_bytes: int = Limits.upload_bytes

    @cached_property
    def board(self) -> Board:
        """The results of this server's challenges."""
        from flexgui.stages.challenge.board import Board  # late: the first challenge needs it

        return Board()
