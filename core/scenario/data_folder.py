"""Where the files of a scenario's recordings are, and which of them it may read."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError
from ..recording.read_table import folder_sentence
from ..scenario.schema import Scenario
from ..sentences import listed, one_line, quoted

VARIABLE = "FLEXGUI_DATA"
OPTION = "--data"

_PLAIN = re.compile(r"[\w+=-](?:[\w.+= -]{0,118}[\w+=-])?")
"""Letters, digits and what no file system or shell minds; no slash of any kind, no colon, no dot
or blank at either end. 120 characters: an upload's name has 80, a number may follow."""
_DEVICE = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\.|$)", re.IGNORECASE)
"""Windows opens a device under these names, in every folder and with any ending."""


@dataclass(frozen=True)
class ConfinedFolder:
    """A folder that a scenario from elsewhere must not leave: it may name files in it, plainly."""

    folder: Path

    def find(self, file: str) -> Path:
        """The path of a recording's file; InputError where it is none of this very folder."""
        check_plain(file)
        path = self.folder / file
        try:
            regular = stat.S_ISREG(path.lstat().st_mode)  # a link is none
            inside = path.resolve().parent == self.folder.resolve()
        except OSError:
            regular = inside = False
        if not regular or not inside:
            raise InputError(
                f"The recording {file} is not among the files of this session; upload it, or one "
                f"zip of the scenario and its recordings."
            )
        return path


Folder = Path | ConfinedFolder
"""Where a scenario's relative files are sought; a path alone may be left by `..` and the like."""


def is_device(file: str) -> bool:
    """Whether Windows takes the name for a device."""
    return _DEVICE.match(file) is not None


def check_plain(file: str) -> None:
    """InputError where a name could lead out of a folder, on any system."""
    if not _PLAIN.fullmatch(file) or is_device(file):
        raise InputError(
            f"The recording {quoted(file)} is not a plain file name; upload it in one zip with its "
            f"scenario, and write its name without folders."
        )


def resolve_file(file: str, beside: Folder, data_folder: Path | None = None) -> Path:
    """The path of a recording's file; InputError where it is in none of these folders.

    Looked for in the scenario's folder `beside` first, then in the data folder: `data_folder`
    (the option) or else the environment's FLEXGUI_DATA. Within a folder nothing else counts.
    """
    if isinstance(beside, ConfinedFolder):
        return beside.find(file)
    folders = [beside, *_data_folders(data_folder)]
    for folder in folders:
        if (folder / file).is_file():
            return folder / file
    places = " and ".join(str(folder) for folder in folders)
    _check_kind(file, folders)
    raise InputError(
        one_line(
            f"The recording {file} was not found in {places}; correct its name, or name the "
            f"folder that holds it with {OPTION} or the variable {VARIABLE}."
        )
    )


def outside(scenario: Scenario, beside: Path, data_folder: Path | None = None) -> str:
    """The sentence about recordings that lie in neither folder, links followed; else empty."""
    folders = [folder.resolve() for folder in (beside, *_data_folders(data_folder))]
    paths = [
        resolve_file(file, beside, data_folder).resolve()
        for spec in scenario.recordings
        for file in spec.files
    ]
    outside_paths = [
        path for path in dict.fromkeys(paths) if not any(map(path.is_relative_to, folders))
    ]
    if not outside_paths:
        return ""
    return f"The scenario reads outside its folder and the data folder: {_some(outside_paths)}."


def refuse_special(path: Path) -> None:
    """InputError for a device, a pipe or a socket, which may never end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError(
            one_line(f"{path} is a device or a pipe; copy its data into a file first.")
        )


def _check_kind(file: str, folders: Iterable[Path]) -> None:
    for folder in folders:
        refuse_special(folder / file)
        if (folder / file).is_dir():
            raise InputError(one_line(folder_sentence(folder / file)))


_SHOWN = 3
"""Paths in a sentence."""


def _some(paths: Sequence[Path]) -> str:
    more = [f"{len(paths) - _SHOWN} more"] if len(paths) > _SHOWN else []
    return listed([*(str(path) for path in paths[:_SHOWN]), *more])


def _data_folders(option: Path | None) -> list[Path]:
    if option is not None:
        return [option]
    named = os.environ.get(VARIABLE)
    return [Path(named)] if named else []
