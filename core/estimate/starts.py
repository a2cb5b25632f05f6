"""Starts of a refit, chosen over a growing horizon.

A fit that lacks an effect distorts its other parameters. With the effect added, it starts from the
fitted and from the nominal values, each with the sizes of the screen.

A soft base, an elastic joint or backlash also vibrates. Over whole recordings the cost then has
many minima: model and recording meet again after some more or fewer periods. Over the first periods
the cost has few minima (core.identify.refinement). So the starts, with all sizes of the screen's
grid and some between, are compared there; the best continue over more of each recording. Of several
sizes each combination of the grid is compared, since one joint may be much softer than the next;
from the best, each size by itself goes over the sizes between.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from operator import itemgetter

import numpy as np

from ..arm.arm import Structure
from ..effects.effect import Effect
from ..estimate.problem import FitData, Problem, parameter_names, problem_of
from ..identify.refinement import FEWEST_PER_UNKNOWN, HORIZON_TOLERANCE, HORIZONS, first_parts
from ..lanes.wide import LANES
from ..least_squares import (
    as_finite,
    cost_of,
    levenberg_marquardt,
    normal_equations,
    pseudo_inverse,
)

GRID_RATIO = 1.15
"""Ratio of neighbouring sizes that are compared. For a spring with ten periods in a recording, the
minimum is a tenth of its frequency wide, a fifth of its compliance."""

SIZES_AROUND = GRID_RATIO ** np.arange(-8, 8)
"""Factors on one of several sizes: as far as the next of the screen's grid."""

TRIAL_ITERATIONS = 3
"""Iterations of each start or candidate before the others stop. The first goes where the linear
prediction leads; the others test that prediction."""

KEPT_STARTS = 3
"""Starts that continue."""

ROUGH_ITERATIONS = 10
"""Iterations of a fit that is only compared; accepted models are converged afterwards."""

HORIZON_GROWTH = 4
"""Factor on the share of each recording for the last descent, so that the start on the whole is out
of phase by less than a period."""

LEAST_ERROR = 10.0
"""Squared error above noise, in noise floors and per unknown, that the first part must show: a
recording may begin at rest."""

LEAST_CHANGE = 0.02
"""Relative change of a parameter from nominal that makes a second start worthwhile."""

Values = dict[str, float]
"""label -> value"""

Grids = Mapping[str, np.ndarray]
"""label -> sizes in order"""

Minimum = tuple[float, np.ndarray]
"""Cost and vector (P,)."""
COST = itemgetter(0)


def starts(
    data: FitData, base: Problem, effects: Sequence[Effect],
    values: Mapping[str, float], scanned: Sequence[str], stopped: Callable[[], bool],
) -> list[Values]:  # fmt: skip
    """Starts of the model with `effects`, the new one last, over whole recordings; the first begins
    where the base stands, at its minimum without the new effect. `values`: where the screen would
    begin; `scanned`: those parameters among them that come from a grid."""
    from_base = {**base.values(), **values}
    changes = _start_changes(data, base.values())
    horizon = Horizon.for_effects(data, base, effects, values, stopped)
    if horizon is None:
        return [{**from_base, **arm} for arm in changes]
    first = horizon.best(grids(data, effects, scanned), from_base, changes)
    return [from_base] if first is None else [from_base, first]


def share_of_first_swings(
    data: FitData, base: Problem, effects: Sequence[Effect],
    values: Mapping[str, float], scanned: Sequence[str], stopped: Callable[[], bool],
) -> float:  # fmt: skip
    """Share of the base's error above noise over the first part of each recording, its unknowns
    adapted, that the last of the effects takes away at the best size of its grid; 0 for effects
    that do not vibrate."""
    horizon = Horizon.for_effects(data, base, effects, values, stopped)
    if horizon is None:
        return 0.0
    sizes, from_base = grids(data, effects, scanned), {**base.values(), **values}
    changes = _start_changes(data, base.values())
    left = [cost for x in changes for cost, _ in horizon.local_minima({**from_base, **x}, sizes)]
    # Over so short a part the other unknowns alone explain much.
    problem = problem_of(horizon.first, effects[:-1], from_base)
    ((cost, _),) = profile_costs(problem, (), [problem.vector])
    return max((cost - min(left, default=cost)) / max(cost - horizon.first.count, 1.0), 0.0)


def differs_from_nominal(data: FitData, values: Mapping[str, float]) -> bool:
    """Whether a nominal parameter has left its nominal value."""
    shared = {u.label: u.parameter.value for u in data.nuisance if u.recording is None}
    return any(abs(values.get(k, x) - x) > LEAST_CHANGE * abs(x) for k, x in shared.items())


def nominal_values(data: FitData) -> Values:
    """label -> nominal value of each unknown beside those of effects. The first states of
    recordings belong to them: fitted while an effect was missing, they have taken up a part of it.
    """
    return {u.label: u.parameter.value for u in data.nuisance}


def _start_changes(data: FitData, at: Mapping[str, float]) -> list[Values]:
    """Changes of the current values for a start: none, or to the nominal values if they differ."""
    return [{}, nominal_values(data)] if differs_from_nominal(data, at) else [{}]


@dataclass(frozen=True)
class Horizon:
    """Models with `effects` over the first `share` of each recording. Sizes in `held` are fixed: a
    limit that the first part does not reach has no minimum."""

    data: FitData
    effects: Sequence[Effect]
    share: float
    held: Collection[str]
    stopped: Callable[[], bool]

    @classmethod
    def for_effects(
        cls, data: FitData, base: Problem, effects: Sequence[Effect],
        values: Mapping[str, float], stopped: Callable[[], bool],
    ) -> Horizon | None:  # fmt: skip
        """None if the last effect leaves the arm's vibrations unchanged, or if no first part shows
        enough."""
        if not vibrates(data, base, effects, values):
            return None
        share = _informative_share(data, base, len(problem_of(data, effects, values).vector))
        fixed = tuple(base.model.effect_parameters)
        return None if share is None else cls(data, effects, share, fixed, stopped)

    @cached_property
    def first(self) -> FitData:
        """The data of the first parts."""
        return first_part_of(self.data, self.share)

    def best(
        self, sizes: Grids, values: Mapping[str, float], changes: Sequence[Values]
    ) -> Values | None:
        """Values that the best start leads to. Starts are `values` with each of `changes`, at their
        own sizes and at the local minima among `sizes`."""
        candidates: list[Values] = []
        for arm in changes:
            at = {**values, **arm}
            candidates += [at, *(there for _, there in self.local_minima(at, sizes))]
        distinct = [start for k, start in enumerate(candidates) if start not in candidates[:k]]
        trials = sorted(
            (self.descended(start, TRIAL_ITERATIONS) for start in distinct),
            key=lambda start: start[0],
        )
        descents = [self.descended(start, ROUGH_ITERATIONS) for _, start in trials[:KEPT_STARTS]]
        return self.extended(min(descents, key=lambda start: start[0]))

    def descended(self, values: Mapping[str, float], most: int) -> tuple[float, Values]:
        """Cost per sample and values after at most `most` iterations."""
        problem = _with_free_sizes(self.first, self.effects, values, self.held).half_substeps
        result = levenberg_marquardt(
            problem.errors, problem.slopes, problem.vector, problem.limits, self.stopped, most=most
        )
        return result.cost / self.first.count, {**values, **problem.at(result.vector).values()}

    def extended(self, start: tuple[float, Values]) -> Values | None:
        """Values after a descent over more of each recording, all sizes free; None if it
        diverged."""
        cost, best = start
        if HORIZON_GROWTH * self.share < 1.0:
            more = replace(self, share=HORIZON_GROWTH * self.share, held=())
            cost, best = more.descended(best, ROUGH_ITERATIONS)
        return best if np.isfinite(cost) else None

    def local_minima(self, at: Values, sizes: Grids) -> list[tuple[float, Values]]:
        """The best local minima among some sizes, with their costs, all other unknowns adapted."""
        problem = _with_free_sizes(self.first, self.effects, at, self.held)
        labels = problem.unknowns.labels
        tried = {name: grid for name, grid in sizes.items() if name in labels}
        along = [labels.index(name) for name in tried]
        if len(along) > 1:
            combined = np.array(list(product(*tried.values())))
            best = min(self._profile(problem, along, combined), key=COST)
            ends = [self._each_size(problem, best, along)]
        else:
            each = [refined_grid(grid)[:, None] for grid in tried.values()]
            ends = [end for grid in each for end in _valleys(self._profile(problem, along, grid))]
        return [(cost, {**at, **problem.at(vector).values()}) for cost, vector in ends]

    def _profile(self, problem: Problem, along: Sequence[int], grid: np.ndarray) -> list[Minimum]:
        """(cost, vector) with the unknowns `along` at each row of a grid (N, len(along))."""
        vectors = np.repeat(problem.vector[None], len(grid), axis=0)
        vectors[:, along] = grid
        return profile_costs(problem, along, list(vectors), self.stopped)

    def _each_size(self, problem: Problem, best: Minimum, along: Sequence[int]) -> Minimum:
        """After each of the sizes `along` has gone over those around it by itself, as often as one
        of them finds better."""
        unchanged, turn = 0, 0
        while unchanged < len(along) and not self.stopped():
            column = turn % len(along)
            rows = np.repeat(best[1][along][None], len(SIZES_AROUND), axis=0)
            rows[:, column] *= SIZES_AROUND
            found = min(self._profile(problem.at(best[1]), along, rows), key=COST)
            better = found[0] < (1.0 - HORIZON_TOLERANCE) * best[0]
            unchanged, turn = (0 if better else unchanged + 1), turn + 1
            best = found if better else best
        return best


def _valleys(ends: Sequence[Minimum]) -> list[Minimum]:
    """The best of those below their neighbours along a grid."""
    edged = [np.inf, *map(COST, ends), np.inf]
    lowest = [ends[k] for k in range(len(ends)) if edged[k] > edged[k + 1] <= edged[k + 2]]
    return sorted(lowest, key=COST)[:KEPT_STARTS]


def vibrates(
    data: FitData, base: Problem, effects: Sequence[Effect],
    values: Mapping[str, float],
) -> bool:  # fmt: skip
    """Whether the last effect changes the arm's vibrations."""
    model = data.bare.with_effects(effects, {**values}, data.sizes)
    own = parameter_names(effects[-1], model, data.sizes)
    other_arm = Structure.of(model.arm) != Structure.of(base.model.arm)
    return other_arm or not model.arm_catalogue.entries.keys().isdisjoint(own)


def first_part_of(data: FitData, share: float) -> FitData:
    """The data over the first `share` of each recording."""
    return replace(data, experiments=tuple(first_parts(data.experiments, share)), anchor=None)


def _informative_share(data: FitData, base: Problem, unknowns: int) -> float | None:
    """The smallest share of each recording over which the error of `base` exceeds noise; None:
    none."""
    errors = base.errors(base.vector)
    for share in HORIZONS:
        cost, count = 0.0, 0
        for e, r in zip(data.experiments, errors, strict=True):
            part = slice(0, int(np.ceil(share * len(r))))
            cost += float(np.sum(np.square(r[part])))
            count += int(e.counted[part].sum())
        shown = count >= FEWEST_PER_UNKNOWN * unknowns and cost > count + LEAST_ERROR * unknowns
        # A filter may need more than so short a part.
        if shown and first_part_of(data, share).experiments:
            return share
    return None


def _with_free_sizes(
    data: FitData, effects: Sequence[Effect], values: Mapping[str, float], fixed: Collection[str]
) -> Problem:
    """The model with `effects`; all is free but the sizes `fixed`."""
    problem = problem_of(data, effects, values)
    if not fixed:
        return problem
    nominal = {u.parameter.name for u in data.nuisance}
    named = [u for u in problem.unknowns.items if u.parameter.name not in nominal]
    free = tuple(u for u in named if u.parameter.name not in fixed)
    return problem_of(data, effects, values, freed=free)


def grids(data: FitData, effects: Sequence[Effect], scanned: Sequence[str]) -> Grids:
    """The screen's sizes of each of the `scanned` parameters."""
    arm = data.bare.with_effects(effects).arm
    items = [k for e in effects for k in e.parameters(arm, data.bare.drive, data.sizes) if k.grid]
    return {k.parameter.name: np.sort(k.grid) for k in items if k.parameter.name in scanned}


def refined_grid(sizes: np.ndarray) -> np.ndarray:
    """(K,) a grid of `sizes` (k,) in order, with points between so that neighbours differ by
    GRID_RATIO at most."""
    refined = [sizes[:1]]
    for a, b in pairwise(sizes):
        count = int(np.ceil(abs(np.log(b / a)) / np.log(GRID_RATIO))) if a * b > 0.0 else 1
        shares = np.arange(1, count + 1) / count
        refined.append(a * (b / a) ** shares if count > 1 else np.array([b]))
    return np.concatenate(refined)


def profile_costs(
    problem: Problem, along: Collection[int], vectors: Sequence[np.ndarray],
    stopped: Callable[[], bool] = lambda: False,
) -> list[Minimum]:  # fmt: skip
    """(cost, vector (P,)) at each of `vectors`, which differ in the unknowns `along`; the other
    unknowns take one linear step. Fewer if stopped.

    With the others fixed, the true minimum may not show: a first beam wrong by 2 % hid that of the
    second. Sensitivities of one point are accurate enough near the minimum, and so are few steps.
    """
    others, limits = ~np.isin(np.arange(len(problem.vector)), list(along)), problem.limits
    slopes = [as_finite(S)[:, :, others] for S in problem.slopes(problem.vector)]
    profile: list[Minimum] = []
    for k in range(0, len(vectors), LANES):  # one recording fills the lanes
        if stopped():
            break
        some = vectors[k : k + LANES]
        for x, errors in zip(some, problem.half_substeps.errors_at(some), strict=True):
            A, b = normal_equations([as_finite(e) for e in errors], slopes)
            known, weights = (each[others] for each in limits.prior_measurements(x))
            A, b = A + np.diag(weights**2), b + known * weights
            inverse = pseudo_inverse(A)
            minimum = x.copy()
            minimum[others] -= inverse @ b
            cost = cost_of(errors) + float(limits.prior_cost(x)) - float(b @ inverse @ b)
            profile.append((cost, np.clip(minimum, limits.lower, limits.upper)))
    return profile
