"""The scenario as a file to take away: with the recordings in one zip where it has files."""

from __future__ import annotations

from pathlib import Path

from core.diagnosed import diagnosed_toml
from core.results import Diagnosis
from core.scenario.data_folder import Within
from core.scenario.read import scenario_toml
from core.scenario.schema import Scenario
from flexgui.export.folder import zipped
from flexgui.session.uploads import safe_name


def scenario_file(scenario: Scenario, folder: Path) -> tuple[str, bytes]:
    """(name, content): a TOML file, or a zip of it and its recordings' files.

    InputError where a file is gone, or is none of the folder.
    """
    name = safe_name(scenario.title).replace(" ", "_") or "scenario"
    return bundled(name, scenario_toml(scenario), scenario, folder)


def diagnosed_file(scenario: Scenario, found: Diagnosis, folder: Path) -> tuple[str, bytes]:
    """The same of the scenario with what a diagnosis found."""
    name = safe_name(scenario.title).replace(" ", "_") or "scenario"
    return bundled(f"{name}_diagnosed", diagnosed_toml(scenario, found), scenario, folder)


def bundled(name: str, text: str, scenario: Scenario, folder: Path) -> tuple[str, bytes]:
    """A text about the scenario's recordings, with their files where it has any."""
    files = recordings_of(scenario, folder)
    if not files:
        return f"{name}.toml", text.encode()
    return f"{name}.zip", zipped({f"{name}.toml": text.encode(), **files})


def recordings_of(scenario: Scenario, folder: Path) -> dict[str, bytes]:
    """file -> content of the scenario's recordings; InputError where one is none of the folder."""
    names = sorted({file for spec in scenario.recordings for file in spec.files})
    return {name: Within(folder).find(name).read_bytes() for name in names}


def zipped_folder(folder: Path, beside: dict[str, bytes] | None = None) -> bytes:
    """A zip of all files below a folder, and of what is to lie beside them."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    content = {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
    return zipped({**(beside or {}), **content})
