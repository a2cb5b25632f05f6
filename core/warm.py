"""The first start on a machine: kernels are compiled by processes of their own, side by side.

The compiler works on one function at a time in one process, and whoever else runs Python there
waits for it.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterable
from contextlib import suppress

from core.arm.arm import Structure
from core.arm.beforehand import begin, compile_beforehand
from core.arm.cache import cache_folder, sources_key
from core.processors import WORKERS
from core.progress import Progress

TITLE = "Compiling for this machine, once (about half a minute)"

_COMMAND = (
    "import os; getattr(os, 'nice', int)(5); "
    "from core.simulate.{} import {} as kernel; kernel.compiled"
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
            for one in [one for one in running if one.poll() is not None]:
                running.remove(one)
                whole = whole and one.returncode == 0
                progress.advance()
        if whole:
            (cache_folder() / f"warm_{sources_key()}").touch()
