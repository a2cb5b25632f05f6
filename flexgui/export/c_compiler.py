"""The C compiler of this machine, where there is one."""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

NAMES = ("cc", "gcc", "clang")

FLAGS = ("-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off")
"""Without fused multiply-add, so that the same source computes the same everywhere."""

PATIENCE = 60.0
"""s; it takes a fraction of one."""

SUFFIXES = {"linux": ".so", "darwin": ".dylib", "windows": ".dll"}


def compiler() -> str | None:
    """Path of the first that is there."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


def library_place() -> str:
    """Where a shared library of this platform stands in an FMU (FMI 3.0, section 2.5.1.5)."""
    system = {"win32": "windows"}.get(sys.platform, sys.platform)
    machine = platform.machine().lower()
    known = {"amd64": "x86_64", "arm64": "aarch64"}
    return f"{known.get(machine, machine)}-{system}/flexmodel{SUFFIXES.get(system, '.so')}"


def shared_library(sources: Mapping[str, str]) -> bytes | None:
    """The library of some C files (name -> text); None where no compiler makes one of them."""
    return _compiled(tuple(sorted(sources.items())))


@lru_cache(4)
def _compiled(sources: tuple[tuple[str, str], ...]) -> bytes | None:
    path = compiler()
    if path is None:
        return None
    with tempfile.TemporaryDirectory() as room:
        for name, text in sources:
            (Path(room) / name).write_text(text, encoding="utf-8")
        files = [name for name, _ in sources if name.endswith(".c")]
        order = [path, *FLAGS, "-o", "library", *files, "-lm"]
        try:
            subprocess.run(order, cwd=room, check=True, capture_output=True, timeout=PATIENCE)
            return (Path(room) / "library").read_bytes()
        except (OSError, subprocess.SubprocessError):
            return None
