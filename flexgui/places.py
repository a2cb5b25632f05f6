"""Where the server keeps what of a session, and sentences for a browser that do not say it."""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
import time
from functools import cache
from pathlib import Path

_ROOT = Path(__file__).resolve().parents[1]
_BELOW = r"(?=[/\\\s'\",;:.]|$)(?:[/\\][^/\\\s'\",;:]*)*"
"""The rest of a path after one of its folders."""


def without_places(text: str, *folders: Path) -> str:
    """The text with only the last part of each path below `folders` or the server's own places."""
    for folder in (*map(str, folders), *_own()):
        text = re.sub(re.escape(folder) + _BELOW, lambda found: _last(found[0]), text)
    return text


def _last(path: str) -> str:
    return re.split(r"[/\\]", path.rstrip("/\\"))[-1]


@cache
def _own() -> tuple[str, ...]:
    """The longest first: one may lie in another."""
    found = {tempfile.gettempdir(), str(Path.home()), sys.prefix, sys.base_prefix, str(_ROOT)}
    return tuple(sorted((each for each in found if len(Path(each).parts) > 1), key=len)[::-1])


WORK, RESULTS = ".work.npz", ".results.npz"
"""What was stated, and what was found. No upload has such a name, and no scenario may read it."""
OWNER = ".server"
"""Holds the process that uses the folder."""

FRESH = "-fresh"
"""Ends the name of a folder whose work a person has just replaced by earlier work."""


def is_kept(folder: Path) -> bool:
    """Whether there is work in a session's folder."""
    return (folder / WORK).is_file()


def kept_at(folder: Path) -> float:
    """When it was changed last, s of the clock."""
    return max((folder / n).stat().st_mtime for n in (WORK, RESULTS) if (folder / n).exists())


def earlier_folder(folder: Path) -> Path:
    """Where the work of the session before waits."""
    return folder.with_name(f"{folder.name}-before")


def set_aside(path: Path, when: float, why: str = "unread") -> str:
    """Renames stored work, so that nothing overwrites it; its new name."""
    date = time.strftime("%Y-%m-%d-%H%M%S", time.localtime(when))
    name = f"{why}-{date}{path.name if path.is_file() else f'-{path.name[:8]}'}"
    path.rename(path.with_name(name))
    return name


def remove_half_written(folder: Path) -> None:
    """Removes what somebody who was killed was writing or unpacking: all of it is hidden."""
    for path in folder.glob(".*"):
        if path.name in (WORK, RESULTS, OWNER):
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
