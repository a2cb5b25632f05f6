"""Plug-ins: one file each, found by walking a folder. Adding one edits no other file."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from types import ModuleType
from typing import Generic, TypeVar

from core.errors import InputError
from core.sentences import did_you_mean

T = TypeVar("T")


def modules_of(package: str) -> list[ModuleType]:
    """All modules in a package's folder, imported."""
    folder = importlib.import_module(package)
    names = [info.name for info in pkgutil.iter_modules(folder.__path__)]
    return [importlib.import_module(f"{package}.{name}") for name in names]


def classes_of(package: str, base: type) -> dict[str, type]:
    """kind -> class, for each class of the package's modules that derives from `base`."""
    found: dict[str, type] = {}
    for module in modules_of(package):
        for thing in vars(module).values():
            if not (isinstance(thing, type) and issubclass(thing, base)):
                continue
            kind = str(getattr(thing, "kind", ""))
            if kind and thing.__module__ == module.__name__:
                found[kind] = thing
    return found


class Registry(Generic[T]):
    """The plug-ins of one folder by their `kind`."""

    def __init__(self, members: dict[str, T]) -> None:
        self.members = members

    def named(self, kind: str, what: str) -> T:
        """The plug-in called `kind`; `what` names the setting in the message."""
        if kind in self.members:
            return self.members[kind]
        raise InputError(f"{what} {kind!r} is not known; {did_you_mean(kind, self.members)}")


@cache
def discover(package: str, base: type[T]) -> Registry[T]:
    """One instance per concrete subclass of `base` with a `kind`, in the modules of `package`."""
    return Registry({kind: thing() for kind, thing in classes_of(package, base).items()})
