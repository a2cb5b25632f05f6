"""The scenario as a file to take away: with the recordings in one zip where it has files."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

from core.scenario.data_folder import Within
from core.scenario.schema import Scenario
from core.scenario.write import scenario_toml
from flexgui.session.uploads import safe_name

NEVER = (1980, 1, 1, 0, 0, 0)
"""No date inside: the same work gives the same bytes."""


def scenario_file(scenario: Scenario, folder: Path) -> tuple[str, bytes]:
    """(name, content): a TOML file, or a zip of it and its recordings' files.

    InputError where a file is gone, or is none of the folder.
    """
    name = safe_name(scenario.title).replace(" ", "_") or "scenario"
    text = scenario_toml(scenario).encode()
    files = sorted({spec.file for spec in scenario.recordings if spec.file is not None})
    if not files:
        return f"{name}.toml", text
    content = {f"{name}.toml": text}
    for file in files:
        content[file] = Within(folder).find(file).read_bytes()
    return f"{name}.zip", zipped(content)


def zipped(content: dict[str, bytes]) -> bytes:
    """A zip of name -> bytes."""
    room = io.BytesIO()
    with zipfile.ZipFile(room, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            archive.writestr(zipfile.ZipInfo(name, NEVER), data, zipfile.ZIP_DEFLATED)
    return room.getvalue()


def zipped_folder(folder: Path) -> bytes:
    """A zip of all files below a folder."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return zipped({path.relative_to(folder).as_posix(): path.read_bytes() for path in paths})
