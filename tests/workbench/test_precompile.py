"""A second process compiles what will be needed, and leaves nothing behind."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from numba import float64

from flexgui.core import precompile
from flexgui.core.arm.arm import Structure
from flexgui.core.arm.compiled import is_compiled
from flexgui.core.arm.signatures import Kernel
from flexgui.core.precompile import compile_kernels, kernels_compiled, precompile_arms
from flexgui.core.progress import Silent

SMALL = Structure(joints=("revolute",), modes=(0,), mounts=("previous",))
LONGEST = 120.0
"""s that a rigid link may take beside other work; two are usual."""


@pytest.fixture
def empty(tmp_path, monkeypatch):  # type: ignore[no-untyped-def]
    """A machine that has compiled nothing yet."""
    monkeypatch.setenv("FLEXGUI_CACHE", str(tmp_path))
    monkeypatch.setattr(precompile, "_requested", set())
    monkeypatch.setattr(Kernel, "waits", {})


@pytest.mark.long
def test_what_is_missing_is_compiled_by_another_process_once(empty) -> None:
    assert not is_compiled(SMALL)
    other = precompile_arms([SMALL, SMALL])
    assert other is not None and precompile_arms([SMALL]) is None
    assert other.wait(LONGEST) == 0 and is_compiled(SMALL)


def test_what_is_there_needs_no_process(empty, monkeypatch) -> None:
    monkeypatch.setattr(precompile, "is_compiled", lambda _: True)
    assert precompile_arms([SMALL]) is None


def test_without_another_process_everything_goes_on(empty, monkeypatch) -> None:
    def refuse(*_, **__) -> None:  # type: ignore[no-untyped-def]
        raise OSError("no more processes")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    assert precompile_arms([SMALL]) is None


def test_the_process_ends_with_the_one_that_began_it(empty) -> None:
    script = (
        "from flexgui.core.precompile import precompile_arms\n"
        "from flexgui.core.arm.arm import Structure\n"
        "s = Structure(('revolute',) * 3, (3, 3, 3), ('previous',) * 3)\n"
        "print(precompile_arms([s]).pid)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=LONGEST, check=True
    )
    assert not Path("/proc", done.stdout.strip()).exists()


class Process:
    """Of another processor that compiles until it is told to end."""

    def __init__(self) -> None:
        self.ended, self.returncode = threading.Event(), 0

    def poll(self) -> int | None:
        return 0 if self.ended.is_set() else None


def test_a_kernel_that_is_there_is_not_compiled_again(empty, monkeypatch) -> None:
    begun: list[str] = []

    def start(code: str) -> Process:
        begun.append(code)
        process = Process()
        process.ended.set()
        return process

    monkeypatch.setattr(precompile, "start_process", start)
    compile_kernels(Silent(), kernels=["integrate"])
    assert kernels_compiled(["integrate"]) and not kernels_compiled()
    compile_kernels(Silent())
    assert kernels_compiled() and len(begun) == 4
    assert sum("integrate" in code for code in begun) == 1


def test_who_needs_a_kernel_waits_for_that_one_only(empty, monkeypatch) -> None:
    begun: dict[str, Process] = {}

    def start(code: str) -> Process:
        return begun.setdefault(
            code.removesuffix(" as kernel; kernel.compiled").split()[-1], Process()
        )

    def integrate(x):  # type: ignore[no-untyped-def]
        return x

    def piecewise(x):  # type: ignore[no-untyped-def]
        return x

    monkeypatch.setattr(precompile, "start_process", start)
    with ThreadPoolExecutor(2) as pool:
        all_kernels = pool.submit(compile_kernels, Silent(), 2)
        while len(begun) < 2:
            time.sleep(0.01)
        waiting = pool.submit(Kernel(integrate, float64(float64)), 1.0)
        assert Kernel(piecewise, float64(float64))(2.0) == 2.0, "nobody has begun to compile it"
        assert not waiting.done()
        begun["integrate"].ended.set()
        assert waiting.result(LONGEST) == 1.0 and not all_kernels.done()
        while not all_kernels.done():
            for process in list(begun.values()):
                process.ended.set()
    assert "piecewise" not in begun and kernels_compiled()
