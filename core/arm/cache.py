"""Where compiled code is kept: the user's cache folder, never the project's own folder."""

from __future__ import annotations

import hashlib
import os
from functools import cache
from pathlib import Path

from platformdirs import user_cache_path

VARIABLE = "FLEXGUI_CACHE"
_CORE = Path(__file__).parent.parent
_COMPILED_ROOMS = ("arm", "forces", "lanes", "simulate")


def cache_folder() -> Path:
    """The user's cache folder; the variable FLEXGUI_CACHE moves it."""
    chosen = os.environ.get(VARIABLE)
    return Path(chosen) if chosen else user_cache_path("flexgui", appauthor=False)


@cache
def sources_key() -> str:
    """Changes with any source that is compiled or that writes what is compiled.

    Numba itself watches only the file of the function that it keeps, not of those it calls: an
    edit to one of them would go unnoticed.
    """
    digest = hashlib.sha256()
    files = [*(_CORE / "trajectory.py",)]
    for room in _COMPILED_ROOMS:
        files += sorted((_CORE / room).rglob("*.py"))
    files += sorted((_CORE / "arm").glob("*template.txt"))
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def keep_kernels_here() -> None:
    """Points Numba's cache to a folder of this version, unless the user has chosen one."""
    from numba import config

    if not os.environ.get("NUMBA_CACHE_DIR"):
        config.CACHE_DIR = str(cache_folder() / f"kernels_{sources_key()}")
