"""Writes exports completely or not at all; strict JSON; zips without dates."""

from __future__ import annotations

import io
import json
import shutil
import signal
import tempfile
import threading
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Any

import msgspec
import numpy as np

from flexgui.core.errors import InputError

INDEX = "result.json"
"""Written last; its key `files` lists all files of an export."""

WORKROOM = ".flexgui-"
"""Prefix of the hidden folder in which a new export grows."""


def check_writable(out: Path) -> None:
    """Raise InputError where an export could not be written; call it before the long work."""
    try:
        with work_folder(out):
            pass
    except OSError as error:
        raise InputError(_refusal(out, error)) from None


@contextmanager
def work_folder(out: Path) -> Iterator[Path]:
    """An empty hidden folder inside `out`, removed at the end.

    It lies inside so that it is on the same file system, where a rename is atomic. `out` is
    made where it is missing, and removed again where nothing was put into it;
    NotADirectoryError where it is a file.
    """
    if out.exists() and not out.is_dir():
        raise NotADirectoryError(f"{out} is a file")
    made = [folder for folder in (out, *out.parents) if not folder.exists()]
    out.mkdir(parents=True, exist_ok=True)
    try:
        work = Path(tempfile.mkdtemp(prefix=WORKROOM, dir=out))
        try:
            yield work
        finally:
            shutil.rmtree(work, ignore_errors=True)
    finally:
        with suppress(OSError):  # the first that is not empty
            for folder in made:
                folder.rmdir()


def swap_in(folder: Path, out: Path) -> None:
    """Moves every file of `folder` to its place in `out`; on failure restores the old ones.

    Files that an older export listed and the new one lacks are removed.
    """
    new = sorted(
        (path.relative_to(folder) for path in folder.rglob("*") if path.is_file()),
        key=lambda path: (path.name == INDEX, path),
    )
    stale = [path for path in listed_files(out) if path not in new and (out / path).is_file()]
    with tempfile.TemporaryDirectory(prefix=WORKROOM, dir=out) as backup, _uninterrupted():
        old = Path(backup)
        for path in (*new, *stale):
            if (out / path).exists():
                (old / path).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(out / path, old / path)
        try:
            for path in new:
                (out / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).replace(out / path)
            for path in stale:
                (out / path).unlink()
        except OSError:
            _restore(out, old, new)
            raise


def _restore(out: Path, old: Path, new: list[Path]) -> None:
    for path in new:
        if not (old / path).exists():
            (out / path).unlink(missing_ok=True)
    shutil.copytree(old, out, dirs_exist_ok=True)


def listed_files(out: Path) -> list[Path]:
    """Files that the export in `out` lists as its own, as paths inside `out`."""
    try:
        listed = json.loads((out / INDEX).read_text(encoding="utf-8"))["files"]
        paths = [PurePosixPath(name) for name in listed]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return [Path(p) for p in paths if not p.is_absolute() and ".." not in p.parts]


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Delays Ctrl-C while files are moved.

    Only the main thread ever sees the signal, and only it may say what happens then.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _refusal(out: Path, error: OSError) -> str:
    if out.exists() and not out.is_dir():
        return f"The output {out} is a file; give the name of a folder with --out."
    reason = (error.strerror or str(error)).lower()
    return f"The output folder {out} cannot be written ({reason}); choose another with --out."


NEVER = (1980, 1, 1, 0, 0, 0)


def zipped(content: Mapping[str, bytes]) -> bytes:
    """A zip of name -> bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            archive.writestr(zipfile.ZipInfo(name, NEVER), data, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def dumps(value: Any) -> str:
    """Strict JSON text in UTF-8 with a final newline; non-finite numbers are null.

    Records, arrays and any mapping may be in it.
    """
    plain = json.loads(msgspec.json.encode(value, enc_hook=_plain))
    return json.dumps(plain, ensure_ascii=False, indent=1) + "\n"


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} is no JSON")
