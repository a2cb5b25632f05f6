"""Ready-made arms: one module per arm, with `ARM` in it, found by walking this folder."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from core.arm.arm import Arm


@cache
def presets() -> dict[str, Arm]:
    """The arms by the names of their modules."""
    names = [info.name for info in pkgutil.iter_modules(__path__)]
    return {name: importlib.import_module(f"{__name__}.{name}").ARM for name in sorted(names)}
