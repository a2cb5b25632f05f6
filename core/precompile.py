"""Compile kernels and arms ahead of time, in separate processes.

The first start on a machine compiles the kernels beside the work; who needs one waits for that one
only. A new arm takes seconds, and a diagnosis tries half a dozen. The compiler blocks all Python
code of its process; loading from the cache, which another process has filled, takes milliseconds.
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
from functools import partial
from pathlib import Path
from typing import Any

from .arm.arm import Structure
from .arm.cache import cache_folder, sources_key
from .arm.compiled import compile_arm, compile_wide_arm, is_compiled
from .arm.signatures import Kernel
from .processors import WORKERS, is_limited
from .progress import Progress, Silent, announce

TITLE = "Compiling for this machine, once (up to half a minute)"

_COMMAND = (
    "import os; getattr(os, 'nice', int)(5); "
    f"from {__package__}.simulate.{{}} import {{}} as kernel; kernel.compiled"
)
_KERNELS = {
    "integrate": "rosenbrock", "respond_lanes": "linear", "followed": "along_motion",
    "piecewise": "piecewise",
}  # fmt: skip
"""Kernels of a first result and their modules, in the order in which they are compiled."""
_ALWAYS = ("integrate",)
"""What every diagnosis needs. The others, of linear models, take as long again to compile."""

_begun = threading.Lock()
"""Held once this process has begun to compile the kernels."""

_PAUSE = 0.05
"""s between two checks of the processes."""


def kernels_compiled(kernels: Iterable[str] = tuple(_KERNELS)) -> bool:
    """Whether the kernels of this version are in the cache of this machine."""
    return all(_mark(name).exists() for name in kernels)


def _mark(kernel: str) -> Path:
    """A file that is there once the kernel is in the cache."""
    return cache_folder() / f"warm_{kernel}_{sources_key()}"


def precompile_all(progress: Progress, arms: Iterable[Structure] = ()) -> None:
    """Starts to compile what every work needs where this was not done before, and returns at once.

    `arms` that are needed later are compiled in the background too. Other kernels are compiled when
    they are first used.
    """
    if is_limited() or kernels_compiled(_ALWAYS) or not _begun.acquire(blocking=False):
        precompile_arms(arms)
        return
    progress.stage(TITLE)

    def compile_all() -> None:
        compile_kernels(Silent(), kernels=_ALWAYS)
        precompile_arms(arms)

    threading.Thread(target=compile_all, daemon=True).start()


def compile_kernels(
    progress: Progress, at_once: int = WORKERS, kernels: Iterable[str] = tuple(_KERNELS)
) -> None:
    """Compiles the kernels that are not in the cache, in `at_once` processes at a time.

    Returns when all have ended. Meanwhile the first call of a kernel in this process waits for the
    process that compiles it.
    """
    missing = [name for name in kernels if not kernels_compiled([name])]
    progress.stage(TITLE, len(missing))
    ended = {name: threading.Event() for name in missing}
    waiting, running = list(missing), dict[str, subprocess.Popen[str]]()
    complete = True
    Kernel.waits.update({name: partial(_wait, name, waiting, ended[name]) for name in missing})
    try:
        while waiting or running:
            while waiting and len(running) < at_once:
                with suppress(IndexError):  # of a kernel that is compiled here meanwhile
                    name = waiting.pop(0)
                    running[name] = start_process(_COMMAND.format(_KERNELS[name], name))
            time.sleep(_PAUSE)
            for name in [name for name, process in running.items() if process.poll() is not None]:
                complete = running.pop(name).returncode == 0 and complete
                ended[name].set()
                progress.advance()
            if not complete:  # as when this process ends
                waiting.clear()
        if complete:
            for name in missing:
                _mark(name).touch()
    except OSError:  # no process or file can be made: whoever needs a kernel compiles it
        pass
    finally:
        for event in ended.values():
            event.set()


def _wait(name: str, waiting: list[str], ended: threading.Event) -> None:
    """Returns when another process has compiled the kernel, or none has begun to."""
    announce(TITLE)
    try:
        waiting.remove(name)
    except ValueError:
        ended.wait()


_ARMS_COMMAND = f"from {__name__} import main; main()"
_requested: set[Structure] = set()
_processes: list[subprocess.Popen[str]] = []
_lock = threading.Lock()


def precompile_arms(structures: Iterable[Structure]) -> subprocess.Popen[str] | None:
    """Starts to compile the structures that are not in the cache, the last ones first.

    Returns at once with the process, which ends with this one at the latest; None where there is
    nothing to do, no processor for it, or no process can be started. An arm that is needed
    meanwhile is compiled here.
    """
    if is_limited():
        return None
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
