"""The verdict in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from core.diagnose.verdict import Remains
from core.results import DiagnosisRound, LadderStep


def say(
    verdict: str,
    final: str | None,
    rounds: Sequence[DiagnosisRound],
    steps: Sequence[LadderStep],
    given: Remains,
    left: Remains,
    not_applicable: Mapping[str, str],
) -> tuple[str, ...]:
    """One paragraph each: what was found, how sure, how big, what else, what remains."""
    return (f"{verdict}", f"{final}")
