"""Effects that a model may lack: one file each, found by walking this folder."""

from __future__ import annotations

from collections.abc import Sequence

from core.effects.effect import Effect, Knob, Rig
from core.plugins import discover

__all__ = ["Effect", "Knob", "Rig", "catalogue", "effect", "with_included"]


def catalogue() -> dict[str, Effect]:
    """All effects by their id."""
    return dict(discover(__name__, Effect).members)  # type: ignore[type-abstract]


def effect(kind: str) -> Effect:
    """The effect of that id; InputError with the nearest known one otherwise."""
    return discover(__name__, Effect).named(kind, "[model] effect")  # type: ignore[type-abstract]


def with_included(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects with all that they include, each once, the simpler ones first."""
    found: dict[str, Effect] = {}

    def add(one: Effect) -> None:
        for kind in one.includes:
            add(effect(kind))
        found.setdefault(one.kind, one)

    for one in effects:
        add(one)
    return tuple(found.values())
