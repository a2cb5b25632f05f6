"""Plug-ins: one file each, found by walking a folder. Adding one edits no other file.

A program that uses FlexGUI as a library has no file in that folder; it registers its class.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from functools import cache
from types import ModuleType
from typing import Any, TypeVar

from .errors import InputError
from .sentences import did_you_mean

T = TypeVar("T")


def modules_of(package: str) -> list[ModuleType]:
    """All modules in a package's folder, imported."""
    folder = importlib.import_module(package)
    names = [info.name for info in pkgutil.iter_modules(folder.__path__)]
    return [importlib.import_module(f"{package}.{name}") for name in names]


_REGISTERED: dict[str, dict[str, type]] = {}
"""Package -> kind -> class, of what `register` was given."""


@cache
def classes_of(package: str, base: type) -> Mapping[str, Any]:
    """kind -> class, for each class of the package's modules that derives from `base`, then those
    that were registered."""
    classes: dict[str, type] = {}
    for module in modules_of(package):
        for thing in vars(module).values():
            if not (isinstance(thing, type) and issubclass(thing, base)):
                continue
            kind = str(getattr(thing, "kind", ""))
            if kind and thing.__module__ == module.__name__:
                classes[kind] = thing
    return {**classes, **_REGISTERED.get(package, {})}


def register(package: str, base: type, thing: type) -> None:
    """Add a class to the plug-ins of a package, as if its file stood in the folder.

    Args:
        package: Dotted name of the folder, such as `core.effects`.
        base: The contract that the class must derive from.
        thing: The class; its `kind` is the id by which scenarios name it.

    Raises:
        InputError: Where it is no such class, has no `kind`, or the `kind` is one of the folder's.
    """
    kind = str(getattr(thing, "kind", ""))
    if not (isinstance(thing, type) and issubclass(thing, base)):
        raise InputError(
            f"{thing!r} is not a subclass of {base.__name__}; derive it from that class."
        )
    if not kind:
        raise InputError(f"{thing.__name__} has no kind; give the class a text `kind`, its id.")
    taken = classes_of(package, base).get(kind)
    if taken is not None and kind not in _REGISTERED.get(package, {}):
        raise InputError(
            f"{thing.__name__}: the kind {kind!r} is {taken.__name__}'s; choose another."
        )
    _REGISTERED.setdefault(package, {})[kind] = thing
    look_again()


def unregister(package: str, kind: str) -> None:
    """Take a registered class out again."""
    _REGISTERED.get(package, {}).pop(kind, None)
    look_again()


def look_again() -> None:
    """Forget what was found, so that the folders are walked once more."""
    classes_of.cache_clear()
    discover.cache_clear()


@cache
def discover(package: str, base: type[T]) -> dict[str, T]:
    """One instance per concrete subclass of `base` with a `kind`, in the modules of `package`."""
    contract: type = base
    return {kind: thing() for kind, thing in classes_of(package, contract).items()}


def named(package: str, base: type, kind: str, setting: str) -> Any:
    """The one of these called `kind`, else InputError; `setting` names the setting in it."""
    members = discover(package, base)
    if kind in members:
        return members[kind]
    raise InputError(f"{setting} {kind!r} is not known; {did_you_mean(kind, members)}")
