"""Whether a fitted model stands in the right valley of its parameters.

The error of a vibration over a whole recording has a minimum wherever model and recording meet
again after some more or fewer swings (core.identify.growing). The first swings tell these apart
where they hold more than noise; where a recording begins at rest, or a stiffness shows in a small
vibration only, they do not. What then tells is the cost along each parameter, far to both sides: it
costs few simulations, since all values of a parameter are simulated side by side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from core.diagnose.acceptance import WHOLE
from core.diagnose.data import Data, Hypothesis, again
from core.diagnose.minimum import converged
from core.diagnose.narrow import CLOSER, TOGETHER, batched
from core.diagnose.profile import followed
from core.diagnose.refit import Refit, fit
from core.diagnose.verdict import within_noise
from core.identify.least_squares import whole
from core.identify.unknowns import Unknown
from core.lanes.wide import LANES

PLACES = 2 * LANES
"""To either side, CLOSER to each other: to a ninth and nine times of where it stands, which is more
than nominal values are off."""

MOST = 3
"""Valleys that are looked into."""

LOOK = 4
"""Iterations in each."""

MOST_MOVES = 3
"""From one valley to the next: one for each of so many parameters that stand wrong."""


def in_the_right_valley(
    data: Data, found: Refit, stopped: Callable[[], bool]
) -> tuple[Data, Refit]:
    """The model where another valley explains the recordings to their noise, better than where it
    stands, or all but the last of what they hold beyond it; with the data anchored there.

    While something is missing the lowest minimum may be that of a stiffness which imitates it (a
    beam half as stiff swings like a soft base), and the refits begin better from where it stands.
    But what imitates leaves something: an effect is asked to explain as much before no other is
    tried beside it.
    """
    there, best = data, found
    for _ in range(MOST_MOVES):
        start = better_valley(there, best.hypothesis, stopped)
        if start is None or stopped():
            break
        other, refit = converged(replace(there, anchor=None), start, None, stopped)
        if not _believed(refit) < _believed(best):
            break
        there, best = other, refit
    whole = best.cost - data.count < (1.0 - WHOLE) * (found.cost - data.count)
    return (there, best) if whole or within_noise(there, best.errors) else (data, found)


def better_valley(data: Data, h: Hypothesis, stopped: Callable[[], bool]) -> Hypothesis | None:
    """The model where another minimum of the cost is lower than the one near which it stands.

    Args:
        data: in noise floors.
        h: the model at a minimum.

    Returns:
        None where there is none, or where nothing swings.
    """
    arm = h.model.arm
    if arm.coordinates == arm.joints:
        return None
    here = again(replace(data, anchor=None), h, finer=1)
    starts = _minima(here, [u.label for u in data.nuisance if _may_mislead(u)], stopped)
    if not starts or stopped():
        return None
    looks = [fit(here.at(x), None, stopped, LOOK) for x in (here.vector, *starts)]
    best = min(looks, key=_believed)
    return None if best is looks[0] else best.hypothesis


def _believed(found: Refit) -> float:
    """Squared error, with that against what is known beforehand."""
    return found.cost + float(found.hypothesis.limits.surprise(found.hypothesis.vector))


def _may_mislead(u: Unknown) -> bool:
    """Whether an unknown is a positive parameter that all recordings share."""
    return u.recording is None and u.parameter.positive


def _minima(h: Hypothesis, labels: Sequence[str], stopped: Callable[[], bool]) -> list[np.ndarray]:
    """Vectors (P,) at the lowest minima of the cost along one parameter each, without those at
    which the model stands."""
    slopes = [whole(S) for S in h.slopes(h.vector)]
    found: list[tuple[float, np.ndarray]] = []
    for k in [k for k, label in enumerate(h.unknowns.labels) if label in labels]:
        vectors = _along(h, k)
        ends: list[tuple[float, np.ndarray]] = []
        for some in batched(vectors, TOGETHER):
            if stopped():
                return []
            ends += followed(h, [k], some, slopes)
        costs = [cost for cost, _ in ends]
        at = int(np.argmin([abs(x[k] - h.vector[k]) for x in vectors]))
        lowest = [i for i in range(1, len(ends) - 1) if costs[i] <= min(costs[i - 1], costs[i + 1])]
        found += [ends[i] for i in lowest if i != at and np.isfinite(costs[i])]
    return [x for _, x in sorted(found, key=lambda one: one[0])[:MOST]]


def _along(h: Hypothesis, k: int) -> list[np.ndarray]:
    """Vectors (P,) that differ in unknown k, within its bounds, from small to large."""
    value, parameter = h.vector[k], h.unknowns.items[k].parameter
    sizes = value * CLOSER ** np.arange(-PLACES, PLACES + 1.0)
    return [
        np.where(np.arange(len(h.vector)) == k, size, h.vector)
        for size in sizes
        if parameter.lower <= size <= parameter.upper
    ]
