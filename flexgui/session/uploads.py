"""Files that a person brings: kept in the session's folder under harmless names."""

from __future__ import annotations

import re
import shutil
import zipfile
from filecmp import cmp
from pathlib import Path, PureWindowsPath

from core.errors import InputError
from core.files import replacing
from core.recording.spec import RecordingSpec
from core.scenario.data_folder import is_device, resolve_file
from core.scenario.schema import Scenario

LONGEST = 80
MEGA = 1e6
ZIP_GROWTH = 4
"""Text packs well; a zip that grows more than that over the limit is refused unread."""


def safe_name(name: str) -> str:
    """The last part of a name without anything that a file system or a shell could mind."""
    last = PureWindowsPath(name).name  # knows both kinds of slashes
    plain = re.sub(r"[^\w.\-+= ]+", "_", last)[-LONGEST:].strip(" .") or "recording"
    return f"_{plain}" if is_device(plain) else plain


def free_path(folder: Path, name: str) -> Path:
    """A path that does not exist yet: `th1.csv`, then `th1-2.csv`."""
    stem, dot, rest = name.partition(".")
    path, number = folder / name, 2
    while path.exists():
        path, number = folder / f"{stem}-{number}{dot}{rest}", number + 1
    return path


def keep_upload(folder: Path, name: str, content: bytes, limit: int) -> Path:
    """Writes the content; InputError where it is too large or empty."""
    shown = safe_name(name)
    if len(content) > limit:
        raise InputError(
            f"{shown} has {len(content) / MEGA:.0f} MB; uploads may have {limit / MEGA:.0f} MB, "
            f"cut the recording or keep fewer columns."
        )
    if not content:
        raise InputError(f"{shown} is empty; choose a file with a recording in it.")
    path = free_path(folder, shown)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
    return path


def fetch_files(scenario: Scenario, beside: Path, data: Path | None, folder: Path) -> Scenario:
    """Copies what a trusted scenario reads into the session's folder, under plain names.

    The scenario that names the copies; InputError where a file is missing.
    """

    def fetched(spec: RecordingSpec) -> RecordingSpec:
        if spec.file is None:
            return spec
        name = _copied(resolve_file(spec.file, beside, data), folder)
        return spec if name == spec.file else spec.model_copy(update={"file": name})

    recordings = tuple(fetched(spec) for spec in scenario.recordings)
    return scenario.model_copy(update={"recordings": recordings})


def _copied(source: Path, folder: Path) -> str:
    """The name of a copy in the folder; one that is there already serves again."""
    target = folder / safe_name(source.name)
    if target.is_file() and cmp(source, target, shallow=False):
        return target.name
    target = free_path(folder, target.name)
    with replacing(target) as temporary:
        shutil.copyfile(source, temporary)
    return target.name


def unpacked(path: Path, folder: Path, limit: int) -> Path:
    """Puts the files of a zip into the folder; the scenario file in it. InputError else."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = [m for m in archive.infolist() if not m.is_dir()]
            if sum(m.file_size for m in members) > ZIP_GROWTH * limit:
                raise InputError(
                    f"{path.name} holds more than {ZIP_GROWTH * limit / MEGA:.0f} MB; upload the "
                    f"recordings one by one."
                )
            content = {safe_name(m.filename): archive.read(m) for m in members}
    except (zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError) as error:
        raise InputError(f"{path.name} is not a zip that can be read; make it again.") from error
    scenarios = [name for name in content if name.lower().endswith(".toml")]
    if len(scenarios) != 1:
        raise InputError(
            f"{path.name} holds {len(scenarios)} scenarios; give one with its recordings."
        )
    for name, data in content.items():
        with replacing(folder / name) as temporary:
            temporary.write_bytes(data)
    return folder / scenarios[0]
