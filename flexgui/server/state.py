"""The folder of the user in which a server keeps what outlives it; nobody else may read it."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

from platformdirs import user_state_path

VARIABLE = "FLEXGUI_STATE"
KEY_FILE, KEY_BYTES = "server.key", 32


def state_folder() -> Path:
    """The user's own; the variable FLEXGUI_STATE moves it."""
    chosen = os.environ.get(VARIABLE)
    return Path(chosen) if chosen else user_state_path("flexgui", appauthor=False)


def private(folder: Path) -> Path:
    """The folder, made if need be, closed to others (0700); OSError where it cannot be."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder.chmod(0o700)
    return folder


def server_key() -> bytes:
    """Random, and the same at the next start: who was in with a code that still holds stays in.

    Where nothing can be kept, a fresh one.
    """
    fresh = secrets.token_bytes(KEY_BYTES)
    with contextlib.suppress(OSError):
        path = private(state_folder()) / KEY_FILE
        with contextlib.suppress(FileExistsError):
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(handle, "wb") as file:
                file.write(fresh)
        kept = path.read_bytes()
        if len(kept) == KEY_BYTES:
            return kept
        path.unlink()  # cut short by a crash: the next start makes it anew
    return fresh
