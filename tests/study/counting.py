"""Work that takes no time, where only the book-keeping is tested."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Number:
    """Stands for a case."""

    value: int

    @property
    def key(self) -> str:
        return f"n{self.value}"


def squared(case: Number) -> dict[str, Any]:
    if case.value == 13:
        raise ValueError("unlucky")
    return {"key": case.key, "square": case.value**2}


def nothing() -> None:
    """What a process needs no more than this before such work."""
