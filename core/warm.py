"""Compiling in processes of their own, before anybody needs it.

The first start on a machine compiles the kernels, side by side; an arm that a machine has not met
takes seconds, and a diagnosis tries half a dozen. The compiler works on one function at a time in
one process, and whoever else runs Python there waits for it. What another process has put into the
cache takes milliseconds.
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
    ("rosenbrock", "integrate"), ("pieces", "piecewise"), ("linear", "respond_lanes"),
    ("followed", "followed"),
)  # fmt: skip
"""Module and name of what a first result needs, the longest to compile first."""

_PAUSE = 0.05
"""s between two looks at whether a process has ended."""


def is_warm() -> bool:
    """Whether this version's kernels were compiled on this machine before."""
    return (cache_folder() / f"warm_{sources_key()}").exists()


def warm_up(progress: Progress, arms: Iterable[Structure] = ()) -> None:
    """Compiles everything that a first result needs, where this was not done before.

    `arms` that will be needed later are compiled beside it and beyond.
    """
    compile_beforehand(arms)
    if not is_warm():
        compile_kernels(progress)


def compile_kernels(progress: Progress) -> None:
    """In other processes, as many as the machine has processors; returns when all have ended."""
    progress.stage(TITLE, len(_KERNELS))
    waiting = [_COMMAND.format(*kernel) for kernel in _KERNELS]
    running: list[subprocess.Popen[str]] = []
    whole = True
    with suppress(OSError):  # no process or file can be made: whoever needs a kernel compiles it
        while waiting or running:
            while waiting and len(running) < WORKERS:
                running.append(begin(waiting.pop(0)))
            time.sleep(_PAUSE)
            for process in [process for process in running if process.poll() is not None]:
                running.remove(process)
                whole = whole and process.returncode == 0
                progress.advance()
        if whole:
            (cache_folder() / f"warm_{sources_key()}").touch()


_ARMS_COMMAND = f"from {__name__} import main; main()"
_begun: set[Structure] = set()
_others: list[subprocess.Popen[str]] = []
_lock = threading.Lock()


def compile_beforehand(structures: Iterable[Structure]) -> subprocess.Popen[str] | None:
    """Begins to compile those that are not in the cache; returns at once. The process, which ends
    with this one at the latest; None where there is nothing to do or no process can be started.

    Who needs an arm meanwhile compiles it as ever: the work is begun with the last, which are
    needed last.
    """
    with _lock:
        new = [s for s in dict.fromkeys(structures) if s not in _begun and not is_compiled(s)]
        _begun.update(new)
    if not new:
        return None
    try:
        other = begin(_ARMS_COMMAND)
    except OSError:  # too many processes: whoever needs an arm compiles it
        return None
    assert other.stdin is not None
    with suppress(OSError):
        other.stdin.write(json.dumps([asdict(s) for s in reversed(new)]))
        other.stdin.close()
    return other


def begin(code: str) -> subprocess.Popen[str]:
    """Runs Python code in a process of its own, which ends with this one at the latest; OSError."""
    other = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, text=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    with _lock:
        _others[:] = [*(process for process in _others if process.poll() is None), other]
    return other


@atexit.register
def _end() -> None:
    for other in _others:
        other.kill()
        other.wait()


def main() -> None:
    """Compiles the structures that come as JSON through standard input."""
    for fields in json.load(sys.stdin):
        own: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
        structure = Structure(**own)
        compile_wide_arm(structure)
        compile_arm(structure)
