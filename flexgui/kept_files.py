"""How the work of a session lies in its folder, for the server that looks and the session that
writes."""

from __future__ import annotations

import shutil
from pathlib import Path

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


def remove_half_written(folder: Path) -> None:
    """Removes what somebody who was killed was writing or unpacking: all of it is hidden."""
    for path in folder.glob(".*"):
        if path.name in (WORK, RESULTS, OWNER):
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
