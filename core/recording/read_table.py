"""From a file to its table, by what is in the file."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from ..errors import InputError
from ..plugins import discover
from ..recording.table import Reading, Table, TableReader, Watching, damaged
from ..sentences import few, install_command

SIGNATURE_BYTES = 4096
"""Bytes that show what a file is: every signature stands there, and some lines of text."""


def readers() -> dict[str, TableReader]:
    """The readers by the suffix of the files' usual names."""
    return {s: reader for reader in _all() for s in reader.kind.split() if s.startswith(".")}


def _all() -> list[TableReader]:
    return list(discover(f"{__package__}.readers", TableReader).values())


def read_table(path: Path, progress: Watching | None = None) -> Table:
    """The columns of a file; InputError where it is missing, damaged or of an unknown kind."""
    _check_file(path)
    try:
        with path.open("rb") as file:
            start = file.read(SIGNATURE_BYTES)
    except OSError as error:
        raise InputError(f"{path.name} cannot be read: {error.strerror or error}.") from None
    if not start:
        raise InputError(f"{path.name} is empty; give a file with a header and samples.")
    reader = _reader(path, start)
    _check_installed(path, reader)
    try:
        return reader.read(path, Reading(path, progress))
    except InputError:
        raise
    except (MemoryError, RecursionError) as error:
        raise damaged(path.name, "a recording of a size that fits into memory") from error
    except Exception as error:  # libraries raise whatever wrong bytes lead to
        raise damaged(path.name, reader.file_type, error) from error


def _check_file(path: Path) -> None:
    if not path.exists():
        raise InputError(f"{path} does not exist; check the name and the folder.")
    if path.is_dir():
        raise InputError(folder_sentence(path))
    if not path.is_file():
        raise InputError(f"{path} is a device or a pipe; name a file with a table.")


def folder_sentence(path: Path) -> str:
    """Which files of a folder can be named: the parts of a bag, the episodes of a data set."""
    inside = next((files for reader in _all() if (files := _parts(path, reader))), None)
    if inside is None:
        inside = sorted(p for p in path.glob("*") if known_suffix(p) and p.is_file())
    if not inside:
        return f"{path} is a folder; name the file in it."
    names = [f"{path.name}/{reader.relative_to(path).as_posix()}" for reader in inside]
    return f"{path} is a folder; name one file in it: {few(names)}."


def _parts(path: Path, reader: TableReader) -> list[Path]:
    """The recordings of a folder that is a set of the reader's files; none where it is not."""
    mark, files = reader.folder
    if not mark or not (path / mark).is_file():
        return []
    return sorted(p for p in path.glob(files) if known_suffix(p) and p.is_file())


def known_suffix(path: Path) -> str:
    """The longest known suffix, so that .csv.gz is not taken for another kind of .gz."""
    return max((s for s in readers() if path.name.lower().endswith(s)), key=len, default="")


def _reader(path: Path, start: bytes) -> TableReader:
    """By content; where that says nothing, by the name, so that damage is said of that kind."""
    best = max(_all(), key=lambda reader: reader.fits(path, start))
    if best.fits(path, start):
        return best
    types, suffix = readers(), known_suffix(path)
    if not suffix:
        raise InputError(
            f"{path.name} has a file type that cannot be read; known types: "
            f"{', '.join(sorted(types))}."
        )
    return types[suffix]


def _check_installed(path: Path, reader: TableReader) -> None:
    for module in reader.needs:
        if importlib.util.find_spec(module) is None:
            raise InputError(
                f"{path.name} needs the package {module}, which is not installed; run "
                f"{install_command('lab')}."
            )
