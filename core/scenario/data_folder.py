"""Where the files of a scenario's recordings are."""

from __future__ import annotations

import os
from pathlib import Path

from core.errors import InputError
from core.sentences import one_line

VARIABLE = "FLEXGUI_DATA"
OPTION = "--data"


def resolve_file(file: str, beside: Path, data_folder: Path | None = None) -> Path:
    """The path of a recording's file.

    Looked for in the scenario's folder `beside` first, then in the data folder: `data_folder`
    (the option) or else the environment's FLEXGUI_DATA.
    """
    folders = [beside, *_data_folders(data_folder)]
    for folder in folders:
        if (folder / file).is_file():
            return folder / file
        if (folder / file).exists() and not (folder / file).is_dir():
            raise InputError(one_line(f"{file} is a device or a pipe; name a file with a table."))
    places = " and ".join(str(folder) for folder in folders)
    raise InputError(
        one_line(
            f"The recording {file} was not found in {places}; correct its name, or name the "
            f"folder that holds it with {OPTION} or the variable {VARIABLE}."
        )
    )


def _data_folders(option: Path | None) -> list[Path]:
    if option is not None:
        return [option]
    named = os.environ.get(VARIABLE)
    return [Path(named)] if named else []
