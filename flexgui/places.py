"""Where the server keeps files of a session, and how messages hide these paths."""

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


def hide_paths(text: str, *folders: Path) -> str:
    """The text with only the last part of each path below `folders` or the server's own folders."""
    for folder in (*map(str, folders), *_server_folders()):
        text = re.sub(re.escape(folder) + _BELOW, lambda match: _last(match[0]), text)
    return text


def _last(path: str) -> str:
    return re.split(r"[/\\]", path.rstrip("/\\"))[-1]


@cache
def _server_folders() -> tuple[str, ...]:
    """The server's own folders, the longest first: one may lie in another."""
    folders = {tempfile.gettempdir(), str(Path.home()), sys.prefix, sys.base_prefix, str(_ROOT)}
    return tuple(sorted((f for f in folders if len(Path(f).parts) > 1), key=len)[::-1])


WORK, RESULTS = ".work.npz", ".results.npz"
"""The saved work and the saved results. No upload has such a name, no scenario may read it."""
OWNER = ".server"
"""Names the process that uses the folder."""

REPLACED_SUFFIX = "-fresh"
"""Suffix of a folder whose work was just replaced by restored work."""


def has_saved_work(folder: Path) -> bool:
    """Whether a session's folder holds saved work."""
    return (folder / WORK).is_file()


def saved_at(folder: Path) -> float:
    """When the work was saved last, s (Unix time)."""
    return max((folder / n).stat().st_mtime for n in (WORK, RESULTS) if (folder / n).exists())


def earlier_folder(folder: Path) -> Path:
    """The folder of the session's earlier work."""
    return folder.with_name(f"{folder.name}-before")


def set_aside(path: Path, when: float, why: str = "unread") -> str:
    """Renames saved work of `when` (s since 1970), so that nothing overwrites it; returns the new
    name."""
    date = time.strftime("%Y-%m-%d-%H%M%S", time.localtime(when))
    name = f"{why}-{date}{path.name if path.is_file() else f'-{path.name[:8]}'}"
    path.rename(path.with_name(name))
    return name


def remove_partial_files(folder: Path) -> None:
    """Removes hidden files that a killed process left half written or half unpacked."""
    for path in folder.glob(".*"):
        if path.name in (WORK, RESULTS, OWNER):
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
