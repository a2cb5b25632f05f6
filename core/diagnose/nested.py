"""Effects that contain one another: no competitors, the larger one has the smaller in it."""

from __future__ import annotations

from core.effects import catalogue
from core.sentences import listed


def contains(kind: str, other: str) -> bool:
    """Whether the effect `kind` has the effect `other` in it."""
    one = catalogue().get(kind)
    return one is not None and other in one.includes


def is_nested(kind: str, other: str) -> bool:
    """Whether one of them contains the other."""
    return contains(kind, other) or contains(other, kind)


def nesting(kind: str, best: str) -> str:
    """'contains Coulomb friction', 'part of Stribeck friction', said of `kind`; empty where the
    two are different explanations."""
    known = catalogue()
    if contains(kind, best):
        return f"contains {known[best].title}"
    return f"part of {known[best].title}" if contains(best, kind) else ""


def named(titles: list[str], verb: tuple[str, str]) -> str:
    """'A contains', 'A and B contain': the titles with the verb for one or for several."""
    return f"{listed(titles)} {verb[len(titles) > 1]}"
