"""The server's temporary folder, which only its own user may read."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

PREFIX = "flexgui-"


def new_root() -> Path:
    """A fresh folder (0700), after those of servers that were killed have been removed."""
    _remove_left_behind(Path(tempfile.gettempdir()))
    return Path(tempfile.mkdtemp(prefix=f"{PREFIX}{os.getpid()}-"))


def _remove_left_behind(parent: Path) -> None:
    if os.name != "posix":  # elsewhere asking a process for life may end it
        return
    for path in parent.glob(f"{PREFIX}*-*"):
        process = path.name[len(PREFIX) :].partition("-")[0]
        try:
            mine = path.lstat().st_uid == os.getuid() and path.is_dir() and not path.is_symlink()
        except OSError:
            continue
        if mine and process.isdigit() and not alive(int(process)):
            shutil.rmtree(path, ignore_errors=True)


def born(process: int) -> str:
    """When a process began, in the system's own ticks; "" where there is none, or none is told.

    A number is given again after a restart: another program with it is not the server that had it.
    """
    try:
        after_name = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return ""
    return "" if after_name[0] in "ZX" else after_name[19]


def alive(process: int) -> bool:
    """Whether there is such a process (POSIX)."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
