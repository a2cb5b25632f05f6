"""Effects that a model may lack: one file each, found by walking this folder."""

from __future__ import annotations

from collections.abc import Sequence

from ..effects.effect import Effect, EffectParameter, Rig
from ..plugins import discover, named

__all__ = ["Effect", "EffectParameter", "Rig", "catalogue", "effect", "with_included"]


def catalogue() -> dict[str, Effect]:
    """All effects by their id."""
    return dict(discover(__name__, Effect))


def effect(kind: str) -> Effect:
    """The effect of that id; InputError with the nearest known one otherwise."""
    return named(__name__, Effect, kind, "[model] effect")


def with_included(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects with all effects that they include, the simpler first, each once unless it
    repeats."""
    included: list[Effect] = []

    def add(item: Effect) -> None:
        for kind in item.includes:
            add(effect(kind))
        if item.repeats or item.kind not in {other.kind for other in included}:
            included.append(item)

    for item in effects:
        add(item)
    return tuple(included)
