"""Every module of the program can be imported, those too that only a page imports."""

from __future__ import annotations

import pkgutil
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
