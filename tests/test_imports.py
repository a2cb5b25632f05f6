"""Every module of the program can be imported, those too that only a page imports."""

from __future__ import annotations

import os
import pkgutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import flexgui
from flexgui.core.arm.cache import VARIABLE

MODULES = sorted(
    found.name
    for found in pkgutil.walk_packages(flexgui.__path__, "flexgui.")
    if not found.name.endswith("__main__")
)


def test_each_module_can_be_imported() -> None:
    """In one test: each worker of the suite would list all of them."""
    failed = {}
    for name in MODULES:
        try:
            assert import_module(name).__name__ == name
        except Exception as error:
            failed[name] = repr(error)
    assert MODULES and not failed


NOT_LOADED = {
    "flexgui": ("numpy", "pydantic"),
    "flexgui.cli": ("numpy", "pydantic"),
    # A slip in a scenario is told before what computes is there.
    "flexgui.library.project": (
        "flexgui.core.loading",
        "flexgui.core.simulate.batch",
        "flexgui.core.workbench",
    ),
    # The server listens before it loads what a page needs.
    "flexgui.server.serve": (
        "flexgui.session",
        "flexgui.core.workbench",
        "numba",
        "scipy.optimize",
    ),
    # The warming of the server loads these while the browser loads its own part.
    "flexgui.page.page": (
        "flexgui.core.workbench",
        "numba",
        "sympy",
        "pandas",
        "scipy.signal",
        "scipy.optimize",
    ),
    # The page shows this panel, and computes nothing of it.
    "flexgui.stages.study.panel": ("scipy.signal", "scipy.stats"),
}
"""Module -> what importing it leaves for later: half a second and more, each."""


@pytest.mark.parametrize("module", NOT_LOADED)
def test_importing_is_quick_because_what_is_heavy_comes_later(module: str) -> None:
    asks = f"import sys, {module}; print([n for n in {NOT_LOADED[module]} if n in sys.modules])"
    found = subprocess.run([sys.executable, "-c", asks], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_importing_compiles_nothing(tmp_path: Path) -> None:
    """A first page would wait for kernels that only its jobs need."""
    asks = (
        "from numba.core import event\n"
        "with event.install_recorder('numba:compile') as compiled:\n"
        "    from tests.test_imports import test_each_module_can_be_imported as import_all\n"
        "    import_all()\n"
        "print(len(compiled.buffer))"
    )
    bare = {**os.environ, VARIABLE: str(tmp_path)}
    found = subprocess.run(
        [sys.executable, "-c", asks], capture_output=True, text=True, check=True, env=bare
    )
    assert found.stdout.strip() == "0"
