"""Sizes that end at the bound of what is plausible: what needs one more is something else."""

from __future__ import annotations

import numpy as np

from core.diagnose.data import Data
from core.diagnose.evidence import AT_BOUND, RELEVANT
from core.diagnose.refit import Refit
from core.diagnose.verdict import ABOVE
from core.effects.sizes import typical
from core.identify.least_squares import GOOD_ENOUGH, normal_equations
from core.parameters import Parameter
from core.written import format_number

AT_BOUND_SHARE = 1e-6
"""Of the distance between the bounds."""


def ended_at_bound(after: Refit, data: Data) -> str:
    """A sentence where a size ended at the bound far from neutral and is pressed against it."""
    return next((sentence for _, sentence in at_bounds(after, data)), "")


def at_bounds(after: Refit, data: Data) -> list[tuple[str, str]]:
    """(effect, sentence) of each size at the bound far from neutral, where the recordings want it
    beyond: by any reduction that a descent goes on for, and where the error is down to the floor by
    a relevant one. What nothing presses, such as how soon a friction of no size slips, says
    nothing.
    """
    h = after.hypothesis
    enough = GOOD_ENOUGH if after.cost > ABOVE**2 * data.count else RELEVANT
    effect_parameters = {
        k.parameter.name: (one.kind, k.neutral)
        for one in h.model.effects
        for k in one.parameters(h.model.arm, h.model.drive, typical(h.model.arm))
        if not k.secondary
    }
    return [
        (effect_parameters[u.parameter.name][0], sentence)
        for i, u in enumerate(h.unknowns.items)
        if u.parameter.name in effect_parameters and u.recording is None
        if (sentence := _ends(u.parameter, h.vector[i], effect_parameters[u.parameter.name][1]))
        and beyond(after, i) >= enough * data.count
    ]


def beyond(after: Refit, i: int) -> float:
    """By how much the cost would fall, as straight lines have it, if unknown i could pass the bound
    that it stands at and all others that are inside theirs followed."""
    limits, x = after.hypothesis.limits, after.hypothesis.vector
    near = 1e-6 * limits.scales
    free = (x > limits.lower + near) & (x < limits.upper - near)
    others = np.flatnonzero(free & (np.arange(len(x)) != i))
    A, b = normal_equations(after.descended.blocks, after.descended.slopes)
    size = np.sqrt(np.maximum(np.diag(A), np.finfo(float).tiny))
    A, b = A / np.outer(size, size), b / size
    follow = np.linalg.pinv(A[np.ix_(others, others)], rcond=1e-10, hermitian=True)
    across = A[others, i]
    own = A[i, i] - across @ follow @ across
    push = b[i] - across @ follow @ b[others]
    outward = -push if limits.upper[i] - x[i] < x[i] - limits.lower[i] else push
    return float(push**2 / own) if outward > 0.0 and own > 1e-10 else 0.0


def _ends(p: Parameter, value: float, neutral: float) -> str:
    """A sentence where the value stands at a bound, and not at the one next to neutral."""
    near, beside = AT_BOUND_SHARE * (p.upper - p.lower), AT_BOUND * p.scale
    ends = (
        (p.lower, value - p.lower, neutral <= p.lower + beside),
        (p.upper, p.upper - value, neutral >= p.upper - beside),
    )
    for bound, gap, vanishes in ends:
        if gap <= near and not vanishes:
            return (
                f"{p.title or p.name} ended at {format_number(bound, 3)} {p.unit}, the bound "
                f"of what is plausible."
            )
    return ""
