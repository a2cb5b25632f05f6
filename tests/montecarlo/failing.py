"""Work that fails, in a module that a worker imports at once; its order is a file of its runs."""

from __future__ import annotations

from pathlib import Path


def lose_key(order: str) -> str:
    """A slip of the program."""
    return str({}[_counted(order)])


def fill_memory(order: str) -> str:
    """Not enough memory."""
    raise MemoryError(_counted(order))


def _counted(order: str) -> str:
    with Path(order).open("a", encoding="utf-8") as file:
        file.write("run\n")
    return "mass"
