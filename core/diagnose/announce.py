"""What a round's progress says: how far it is, and why it may take long."""

from __future__ import annotations

from collections.abc import Sequence

from core.arm.arm import Arm
from core.diagnose.columns import Trial, must_compile
from core.sentences import listed


def round_title(number: int, arm: Arm, planned: Sequence[Trial]) -> str:
    """Names the effects among the trials whose arm this machine has never compiled."""
    title = f"Looking for what is missing, round {number}"
    new = list(dict.fromkeys(t.effect.title for t in planned if must_compile(t, arm)))
    if not new:
        return title
    return f"{title} (compiled for the first time, up to a minute each: {listed(new)})"
