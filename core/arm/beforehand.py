"""Arms compiled by a second process before anybody needs them.

An arm that a machine has not met takes seconds to compile, a diagnosis tries half a dozen, and the
compiler works on one function at a time in one process. What another one has put into the cache
takes milliseconds.
"""

from __future__ import annotations

import atexit
import json
import subprocess
import sys
import threading
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict
from typing import Any

from core.arm.arm import Structure
from core.arm.compiled import compile_arm, compile_wide_arm, is_compiled

_COMMAND = "from core.arm.beforehand import main; main()"
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
        other = begin(_COMMAND)
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
        _others[:] = [*(one for one in _others if one.poll() is None), other]
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
