"""What a page gets from the server."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from flexgui.jobs import JobPool


class Services(Protocol):
    """Shared by all sessions."""

    @property
    def pool(self) -> JobPool: ...

    @property
    def data_folder(self) -> Path | None:
        """Where the recordings of ready-made scenarios lie; None where nobody said."""

    @property
    def upload_limit_bytes(self) -> int: ...
