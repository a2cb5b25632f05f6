"""From a file to its table, by the file's suffix."""

from __future__ import annotations

from pathlib import Path

from core.errors import InputError
from core.plugins import discover
from core.recording.reading import Reading, Watching
from core.recording.table import Table, TableReader


def readers() -> dict[str, TableReader]:
    """The readers by suffix."""
    found = discover("core.recording.readers", TableReader)
    return {s: reader for kinds, reader in found.members.items() for s in kinds.split()}


def read_table(path: Path, progress: Watching | None = None) -> Table:
    """The columns of a file; InputError where it is missing, damaged or of an unknown kind."""
    known = readers()
    # The longest suffix that fits, so that .csv.gz is not taken for another kind of .gz.
    fitting = sorted((s for s in known if path.name.lower().endswith(s)), key=len)
    if not fitting:
        raise InputError(
            f"{path.name} is of no kind that can be read; known: {', '.join(sorted(known))}."
        )
    if not path.exists():
        raise InputError(f"{path} does not exist; check the name and the folder.")
    if path.is_dir():
        raise InputError(f"{path} is a folder; name the file in it.")
    if not path.is_file():
        raise InputError(f"{path} is a device or a pipe; name a file with a table.")
    try:
        return known[fitting[-1]].read(path, Reading(path, progress))
    except OSError as error:
        raise InputError(f"{path.name} cannot be read: {error.strerror or error}.") from error
