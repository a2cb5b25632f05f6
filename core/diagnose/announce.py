"""What a round's progress says: how far it is, and why it may take long."""

from __future__ import annotations

from collections.abc import Sequence

from core.arm.arm import Arm
from core.arm.compiled import is_compiled
from core.arm.symbols import Structure
from core.effects.effect import Effect
from core.sentences import listed


def round_title(number: int, arm: Arm, candidates: Sequence[Effect]) -> str:
    """Names the candidates whose arm this machine has never compiled."""
    title = f"Looking for what is missing, round {number}"
    new = [one.title for one in candidates if _is_new(one, arm)]
    if not new:
        return title
    return f"{title} (compiled for the first time, up to a minute each: {listed(new)})"


def _is_new(one: Effect, arm: Arm) -> bool:
    changed = Structure.of(one.changed_arm(arm, {}))
    return changed != Structure.of(arm) and not is_compiled(changed)
