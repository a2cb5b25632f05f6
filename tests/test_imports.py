"""Every module of the program can be imported, those too that only a page imports."""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from importlib import import_module

import core
import flexgui

MODULES = sorted(
    found.name
    for package in (core, flexgui)
    for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
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


SLOW_TO_LOAD = ("flexgui.session", "core.workbench", "numba", "scipy.optimize")
"""What a page needs and the server loads while the browser loads its own part."""


def test_the_server_listens_before_it_loads_what_a_page_needs() -> None:
    asks = (
        f"import sys, flexgui.server.serve; print([n for n in {SLOW_TO_LOAD} if n in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", asks], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
