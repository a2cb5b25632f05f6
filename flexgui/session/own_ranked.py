"""An own effect among the listed ones: all explain the same error of the same model."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from core.results import RankedEffect
from flexgui.session.look import Look, ladder_steps

PRICE = 0.05
"""Of a parameter, in logarithms of what is left: as the listed ones are ranked (design, 6)."""

LEAST_LEFT = 1e-4
"""Share of the error; below it nothing is told apart by it."""


def ranked_with_own(before: Look, after: Look) -> Look:
    """The look before an own effect was added, with the effect in its list; the look itself where
    either has not come so far."""
    own = own_ranked(before, after)
    if own is None or before.found is None:
        return before
    listed = [r for r in before.found.ranking if r.effect != own.effect]
    place = next((k for k, r in enumerate(listed) if _worse(r, own)), len(listed))
    ranking = (*listed[:place], own, *listed[place:])
    return replace(before, found=replace(before.found, ranking=ranking))


def own_ranked(before: Look, after: Look) -> RankedEffect | None:
    """The own effect with which `after` differs, as a row of the list of `before`."""
    if before.found is None or after.found is None or after.added is None or not before.ranking:
        return None
    from core.diagnose.evidence import RELEVANT  # late: it loads all of a diagnosis

    given, grown = (step.cost_per_sample for step in ladder_steps((before, after)))
    drop = max(given - grown, 0.0)
    known = {e.name for e in before.found.step.parameters}
    return RankedEffect(
        effect=after.added,
        title=after.title,
        score=math.nan,
        p_value=math.nan,
        expected_drop_percent=math.nan,
        refit_drop_percent=100.0 * drop / max(given - 1.0, drop, RELEVANT),
        delta_bic=None,
        parameters=tuple(e for e in after.found.step.parameters if e.name not in known),
        predicted=_predicted(before, after),
    )


def _predicted(before: Look, after: Look) -> tuple[np.ndarray, ...]:
    assert before.found is not None and after.found is not None
    pairs = list(zip(before.found.residual, after.found.residual, strict=False))
    alike = before.found.recordings == after.found.recordings
    same = alike and all(a.shape == b.shape for a, b in pairs)
    return tuple(np.asarray(a - b) for a, b in pairs) if same else ()


def _worse(listed: RankedEffect, own: RankedEffect) -> bool:
    return listed.refit_drop_percent is None or _price(listed) > _price(own)


def _price(one: RankedEffect) -> float:
    left = 1.0 - (one.refit_drop_percent or 0.0) / 100.0
    return math.log(max(left, LEAST_LEFT)) + PRICE * len(one.parameters)


def own_place(before: Look, after: Look) -> str:
    """'Your formula is number 2 of 7: it explains 95.1 % of the error; Coulomb friction 99.9 %.'"""
    own = own_ranked(before, after)
    if own is None:
        return ""
    ranking = ranked_with_own(before, after).ranking
    place = next(k for k, r in enumerate(ranking, start=1) if r.effect == own.effect)
    text = (
        f"Your formula is number {place} of {len(ranking)}: it explains "
        f"{own.refit_drop_percent:.1f} % of the error above the noise floor"
    )
    rival = next((r for r in ranking if r.effect != own.effect), None)
    if rival is None or rival.refit_drop_percent is None:
        return f"{text}."
    return f"{text}; the best listed one, {rival.title}, {rival.refit_drop_percent:.1f} %."
