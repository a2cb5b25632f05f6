"""Threads that use the compiler for the first time at one moment do not wait for each other."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
SECONDS = 60.0
"""Imports take a few; two threads that wait for each other never end."""

GENERATED = """
import threading, time
from importlib import import_module
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

with global_compiler_lock:  # as while an arm compiles
    other = threading.Thread(target=import_module, args=("flexgui.core.lanes.functions",))
    other.start()
    time.sleep(3.0)
    assert cpu_target.target_context
other.join()
"""


def test_kernels_begin_in_a_thread_while_an_arm_compiles_in_another(tmp_path: Path) -> None:
    """The moving arm and the equations of the sliders are first needed at the same moment."""
    text = (
        "from flexgui.core.arm.cache import cached_module\n"
        f"cached_module('first_use', lambda: {GENERATED!r})"
    )
    environment = {**os.environ, "FLEXGUI_CACHE": str(tmp_path)}
    subprocess.run(
        [sys.executable, "-c", text], cwd=ROOT, env=environment, timeout=SECONDS, check=True
    )


def test_the_compiler_comes_from_one_module() -> None:
    """Another one might compile before the compiler is ready, or import parts of it too early."""
    direct = {
        f"{path.relative_to(ROOT)}: {node.module}"
        for path in (ROOT / "core").rglob("*.py")
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("numba")
    }
    assert {each.split(":")[0] for each in direct} == {"core/compiler.py"}
