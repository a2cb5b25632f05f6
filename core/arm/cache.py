"""Where compiled code is kept: the user's cache folder, never the project's own folder."""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import shutil
import tempfile
from functools import cache
from pathlib import Path

from platformdirs import user_cache_path

VARIABLE = "FLEXGUI_CACHE"
PACKAGE = Path(__file__).parent.parent
"""The folder of `core`."""
_COMPILED_PACKAGES = ("arm", "forces", "lanes", "simulate")
PROBE = bytes(2**16)
"""What is written to see whether there is room: more than the largest generated module."""
WITHOUT = (
    "The cache folder %s cannot be used (%s), so compiled code is kept in a temporary one and made "
    "anew at each start; free some space there, or name another folder in " + VARIABLE + "."
)

log = logging.getLogger("core.cache")


def cache_folder() -> Path:
    """The user's cache folder; the variable FLEXGUI_CACHE moves it.

    Where nothing can be written there it is a temporary one, which goes with the process.
    """
    chosen = os.environ.get(VARIABLE)
    return _usable(Path(chosen) if chosen else user_cache_path("flexgui", appauthor=False))


@cache
def _usable(folder: Path) -> Path:
    probe = folder / f".probe-{os.getpid()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.write_bytes(PROBE)
        probe.unlink()
    except OSError as error:
        return without_folder(folder, error)
    return folder


def without_folder(folder: Path, error: OSError) -> Path:
    """A temporary folder instead of one that cannot be written any more, said in one sentence."""
    log.warning(WITHOUT, folder, (error.strerror or type(error).__name__).lower())
    temporary = tempfile.mkdtemp(prefix="flexgui-")
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    os.environ[VARIABLE] = temporary  # processes that this one starts share it
    return Path(temporary)


@cache
def sources_key() -> str:
    """Changes with any source that is compiled or that writes what is compiled.

    Numba itself watches only the file of the function that it keeps, not of those it calls: an
    edit to one of them would go unnoticed.
    """
    digest = hashlib.sha256()
    files: list[Path] = []
    for package in _COMPILED_PACKAGES:
        files += sorted((PACKAGE / package).rglob("*.py"))
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def keep_kernels_here() -> None:
    """Points Numba's cache to a folder of this version, unless the user has chosen one."""
    from numba import config

    from core.arm.checksums import share_kernels, verify_kernels

    verify_kernels()
    if not os.environ.get("NUMBA_CACHE_DIR"):
        config.CACHE_DIR = str(cache_folder() / f"kernels_{sources_key()}")
        share_kernels(config.CACHE_DIR)
