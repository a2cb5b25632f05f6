"""Uploaded files, stored in the session's folder under safe names, and zips to download."""

from __future__ import annotations

import lzma
import re
import shutil
import struct
import zipfile
import zlib
from filecmp import cmp
from pathlib import Path, PureWindowsPath

from flexgui.core.errors import InputError
from flexgui.core.files import replacing
from flexgui.core.progress import Progress
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.results import Outcome
from flexgui.core.scenario.data_folder import ConfinedFolder, is_device, resolve_file
from flexgui.core.scenario.read import scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.export.folder import zipped

LONGEST_FILE_NAME = 80
MEGA = 1e6
ZIP_GROWTH = 4
"""Text packs well; a zip that grows more than that over the limit is refused."""
PIECE = 2**18
"""Bytes that are unpacked at once, and then counted."""
BROKEN = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, OSError, RuntimeError, ValueError,
    struct.error, MemoryError,
)  # fmt: skip
"""What Python's reader of zips raises where bytes are wrong; also of kinds that it cannot read."""


def safe_name(name: str) -> str:
    """The last part of a name, without characters that a file system or shell may misread."""
    last = PureWindowsPath(name).name  # knows both kinds of slashes
    plain = re.sub(r"[^\w.\-+= ]+", "_", last)[-LONGEST_FILE_NAME:].strip(" .") or "recording"
    return f"_{plain}" if is_device(plain) else plain


def free_path(folder: Path, name: str) -> Path:
    """A path that does not exist yet: `th1.csv`, then `th1-2.csv`."""
    stem, dot, ending = name.partition(".")
    path, number = folder / name, 2
    while path.exists():
        path, number = folder / f"{stem}-{number}{dot}{ending}", number + 1
    return path


def keep_upload(folder: Path, name: str, content: bytes, limit: int) -> Path:
    """Writes the content; InputError if it is too large or empty."""
    shown = safe_name(name)
    if len(content) > limit:
        raise InputError(
            f"{shown} has {len(content) / MEGA:.0f} MB; the limit is {limit / MEGA:.0f} MB. Cut "
            f"the recording or keep fewer columns."
        )
    if not content:
        raise InputError(f"{shown} is empty; choose a file with a recording.")
    path = free_path(folder, shown)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
    return path


def fetch_files(scenario: Scenario, beside: Path, data: Path | None, folder: Path) -> Scenario:
    """Copies the files of a trusted scenario into the session's folder.

    The scenario that names the copies; InputError where a file is missing.
    """

    def fetched(spec: RecordingSpec) -> RecordingSpec:
        named = {"file": spec.file, "played": spec.played}
        copies = {
            key: _copied(resolve_file(name, beside, data), folder)
            for key, name in named.items()
            if name is not None
        }
        moved = {key: name for key, name in copies.items() if name != named[key]}
        return spec.model_copy(update=moved) if moved else spec

    recordings = tuple(fetched(spec) for spec in scenario.recordings)
    return scenario.model_copy(update={"recordings": recordings})


def _copied(source: Path, folder: Path) -> str:
    """Name of a copy in the folder; an existing copy is used again."""
    target = folder / safe_name(source.name)
    if target.is_file() and cmp(source, target, shallow=False):
        return target.name
    target = free_path(folder, target.name)
    with replacing(target) as temporary:
        shutil.copyfile(source, temporary)
    return target.name


def unpacked(path: Path, folder: Path, limit: int) -> Path:
    """Extracts a zip into the folder and returns its scenario file; InputError if it fails."""
    unpacking = unpacking_folder(path)
    try:
        unpacking.mkdir()
        with zipfile.ZipFile(path) as archive:
            _extract_all(archive, unpacking, path.name, ZIP_GROWTH * limit)
        names = sorted(each.name for each in unpacking.iterdir())
        scenarios = [name for name in names if name.lower().endswith(".toml")]
        if len(scenarios) != 1:
            raise InputError(
                f"{path.name} holds {len(scenarios)} scenarios; give one with its recordings."
            )
        for name in names:
            with replacing(folder / name) as temporary:
                (unpacking / name).replace(temporary)
    except InputError:
        raise
    except BROKEN:
        sentence = f"{path.name} is not a zip that can be read; make it again."
        raise InputError(sentence) from None
    finally:
        shutil.rmtree(unpacking, ignore_errors=True)
    return folder / scenarios[0]


def unpacking_folder(path: Path) -> Path:
    """Temporary folder for a zip; the waiting session removes it, even if the worker died."""
    return path.with_name(f".{path.name}.unpacking")


def unpack(folder: str, file: str, limit: int, *, progress: Progress) -> str:
    """`unpacked` as a task of a worker; the name of the scenario file in the folder."""
    place = Path(folder)
    return unpacked(ConfinedFolder(place).find(file), place, limit).name


def _extract_all(archive: zipfile.ZipFile, folder: Path, name: str, limit: int) -> None:
    """Extracts and counts bytes, because the sizes that a zip states may be wrong."""
    remaining = limit
    for member in archive.infolist():
        if member.is_dir():
            continue
        with (
            archive.open(member) as packed,
            (folder / safe_name(member.filename)).open("wb") as file,
        ):
            while piece := packed.read(PIECE):
                remaining -= len(piece)
                if remaining < 0:
                    raise InputError(
                        f"{name} holds more than {limit / MEGA:.0f} MB; upload the recordings one "
                        f"by one."
                    )
                file.write(piece)


def scenario_file(scenario: Scenario, folder: Path) -> tuple[str, bytes]:
    """(name, content): a TOML file, or a zip of it and its recordings' files.

    InputError where a file is gone, or is none of the folder.
    """
    name = safe_name(scenario.title).replace(" ", "_") or "scenario"
    return bundled(name, scenario_toml(scenario), scenario, folder)


def found_file(scenario: Scenario, outcome: Outcome, folder: Path) -> tuple[str, bytes]:
    """The same for the scenario with what was identified and diagnosed."""
    from flexgui.core.diagnosed_scenario import found_texts

    name = safe_name(scenario.title).replace(" ", "_") or "scenario"
    kind, text = list(found_texts(scenario, outcome).items())[-1]
    return bundled(f"{name}_{Path(kind).stem}", text, scenario, folder)


def bundled(name: str, text: str, scenario: Scenario, folder: Path) -> tuple[str, bytes]:
    """A scenario's text, zipped with the files of its recordings if it has any."""
    files = recordings_of(scenario, folder)
    if not files:
        return f"{name}.toml", text.encode()
    return f"{name}.zip", zipped({f"{name}.toml": text.encode(), **files})


def recordings_of(scenario: Scenario, folder: Path) -> dict[str, bytes]:
    """file -> content of the scenario's recordings; InputError where one is none of the folder."""
    names = sorted({file for spec in scenario.recordings for file in spec.files})
    return {name: ConfinedFolder(folder).find(name).read_bytes() for name in names}


def zipped_folder(folder: Path, beside: dict[str, bytes] | None = None) -> bytes:
    """A zip of all files below a folder and of further files."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    content = {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
    return zipped({**(beside or {}), **content})
