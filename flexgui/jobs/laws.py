"""The law of an effect over the speed of each joint, for the picture of the missing torque."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.effects.over_speed import OverSpeed
    from core.model import Model
    from core.results import RankedEffect, RecordingComparison

ROWS = 600
"""Of a motion along which a law that the speed alone does not say is drawn: as many dots as the
picture of the missing torque has."""


def laws_of(
    model: Model, shown: Sequence[RecordingComparison], one: RankedEffect
) -> tuple[tuple[OverSpeed, ...], ...]:
    """For each recording, with the sizes that a refit has found; empty where the effect is no force
    law at the joints, is unknown to the catalogue, or was not refitted yet."""
    from core.effects import catalogue
    from core.effects.over_speed import over_speed

    effect = catalogue().get(one.effect)
    if effect is None or not one.parameters or effect.acts_at not in ("joints", "drive"):
        return ()
    sizes = {e.name: e.value for e in one.parameters}
    grown = model.with_effects([*model.effects, effect], {**model.effect_values, **sizes})
    have = {e.kind for e in model.effects}
    added = [e for e in grown.effects if e.kind not in have]
    found = []
    for each in shown:
        if each.motion is None:
            return ()
        rows = slice(None, None, max(1, -(-len(each.motion.velocity) // ROWS)))
        place, speed = each.motion.position[rows], each.motion.velocity[rows]
        p = grown.numbers(grown.effect_values).p
        found.append(over_speed(added, grown.arm, p, grown.effect_values, place, speed))
    return tuple(found) if all(found) else ()
