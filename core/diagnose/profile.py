"""The cost along some parameters with the others where they make up for it best.

Seen with the others held, the valley in which the truth lies may be no valley at all: a first beam
bent by 2 % hid that of the second, and a stiffness 7 % too low that of a soft base.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from core.diagnose.data import Hypothesis
from core.identify.least_squares import cost_of, normal_equations, whole

TIED = 1e-10
"""Relative, of the squares of what two unknowns do: below this they do the same."""

Slopes = Sequence[np.ndarray]
"""(M, k, P) per recording."""


def followed(
    h: Hypothesis, along: Collection[int], vectors: Sequence[np.ndarray], slopes: Slopes
) -> list[tuple[float, np.ndarray]]:
    """The cost at each of `vectors`, which differ in the unknowns with the numbers `along`, with
    the other unknowns where straight lines take them, and the vector (P,) there.

    The others' slopes are those of one place: beside a valley they hide it, and in it they are
    right enough to show it. So are few steps.
    """
    others, limits = ~np.isin(np.arange(len(h.vector)), list(along)), h.limits
    theirs = [S[:, :, others] for S in slopes]
    found = []
    for x, errors in zip(vectors, h.coarse.errors_of(vectors), strict=True):
        A, b = normal_equations([whole(e) for e in errors], theirs)
        size = np.sqrt(np.maximum(np.diag(A), 1e-300))
        inverse = np.linalg.pinv(A / np.outer(size, size), rcond=TIED, hermitian=True)
        inverse /= np.outer(size, size)
        there = x.copy()
        there[others] -= inverse @ b
        cost = cost_of(errors) - float(b @ inverse @ b)
        found.append((cost, np.clip(there, limits.lower, limits.upper)))
    return found
