"""Compile kernels and arms ahead of time, in separate processes.

The first start on a machine compiles the kernels in parallel. A new arm takes seconds, and a
diagnosis tries half a dozen. The compiler blocks all Python code of its process; loading from the
cache, which another process has filled, takes milliseconds.
"""

from __future__ import annotations

import atexit
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict
from typing import Any

from .arm.arm import Structure
from .arm.cache import cache_folder, sources_key
from .arm.compiled import compile_arm, compile_wide_arm, is_compiled
from .processors import WORKERS
from .progress import Progress

TITLE = "Compiling for this machine, once (about half a minute)"

_COMMAND = (
    "import os; getattr(os, 'nice', int)(5); "
    f"from {__package__}.simulate.{{}} import {{}} as kernel; kernel.compiled"
)
_KERNELS = (
    ("rosenbrock", "integrate"), ("piecewise", "piecewise"), ("linear", "respond_lanes"),
    ("along_motion", "followed"),
)  # fmt: skip
"""Module and name of the kernels of a first result, the slowest to compile first."""

_PAUSE = 0.05
"""s between two checks of the processes."""


def kernels_compiled() -> bool:
    """Whether the kernels of this version are in the cache of this machine."""
    return (cache_folder() / f"warm_{sources_key()}").exists()


def precompile_all(progress: Progress, arms: Iterable[Structure] = ()) -> None:
    """Compiles all kernels where this was not done before.

    `arms` that are needed later are compiled in the background.
    """
    precompile_arms(arms)
    if not kernels_compiled():
        compile_kernels(progress)


def compile_kernels(progress: Progress) -> None:
    """Compiles in as many processes as the machine has processors; returns when all have ended."""
    progress.stage(TITLE, len(_KERNELS))
    waiting = [_COMMAND.format(*kernel) for kernel in _KERNELS]
    running: list[subprocess.Popen[str]] = []
    complete = True
    with suppress(OSError):  # no process or file can be made: whoever needs a kernel compiles it
        while waiting or running:
            while waiting and len(running) < WORKERS:
                running.append(start_process(waiting.pop(0)))
            time.sleep(_PAUSE)
            for process in [process for process in running if process.poll() is not None]:
                running.remove(process)
                complete = complete and process.returncode == 0
                progress.advance()
        if complete:
            (cache_folder() / f"warm_{sources_key()}").touch()


_ARMS_COMMAND = f"from {__name__} import main; main()"
_requested: set[Structure] = set()
_processes: list[subprocess.Popen[str]] = []
_lock = threading.Lock()


def precompile_arms(structures: Iterable[Structure]) -> subprocess.Popen[str] | None:
    """Starts to compile the structures that are not in the cache, the last ones first.

    Returns at once with the process, which ends with this one at the latest; None where there is
    nothing to do or no process can be started. An arm that is needed meanwhile is compiled here.
    """
    with _lock:
        new = [s for s in dict.fromkeys(structures) if s not in _requested and not is_compiled(s)]
        _requested.update(new)
    if not new:
        return None
    try:
        process = start_process(_ARMS_COMMAND)
    except OSError:  # too many processes: whoever needs an arm compiles it
        return None
    assert process.stdin is not None
    with suppress(OSError):
        process.stdin.write(json.dumps([asdict(s) for s in reversed(new)]))
        process.stdin.close()
    return process


def start_process(code: str) -> subprocess.Popen[str]:
    """Runs Python code in a new process, which ends with this one at the latest; raises OSError."""
    new = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, text=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    with _lock:
        _processes[:] = [*(process for process in _processes if process.poll() is None), new]
    return new


@atexit.register
def _end() -> None:
    for process in _processes:
        process.kill()
        process.wait()


def main() -> None:
    """Compiles the structures that come as JSON through standard input."""
    for fields in json.load(sys.stdin):
        own: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
        structure = Structure(**own)
        compile_wide_arm(structure)
        compile_arm(structure)
