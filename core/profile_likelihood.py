"""Profile likelihood: one parameter is held at values beside its estimate, all others are fitted.

It shows what a standard deviation cannot: an interval that is not symmetric, or has no end (Raue et
al. 2009, Bioinformatics 25, 1923). The likelihood of independent errors would be far too sure where
residuals are coloured; it is scaled so that its curvature at the estimate agrees with the standard
deviation that holds for coloured residuals (Chandler and Bate 2007, Biometrika 94, 167).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from .errors import InputError
from .identify.fit import Fitted
from .identify.fit_unknowns import unknowns_with_starts
from .identify.setup import Setup
from .identify.unknowns import Unknowns, fixed_values
from .progress import Progress, Unseen
from .recording.recording import Recording
from .results import Estimate, Profile
from .scenario.schema import IdentifySpec
from .scenario_fits import fit_group
from .sentences import did_you_mean


def profile_likelihood(
    setup: Setup, group: Sequence[Recording], spec: IdentifySpec, name: str, progress: Progress,
    level: float = 0.95, most: int = 12,
) -> Profile:  # fmt: skip
    """Compute the profile of one parameter, outwards from its estimate.

    Args:
        setup: Model and outputs.
        group: Recordings of one fit.
        spec: What is estimated, beginning at its start.
        name: Label of the parameter.
        progress: Hears of each fit; where it stops, the profile is what there is.
        level: Probability of the interval.
        most: Values on each side of the estimate.

    Raises:
        InputError: Where it is not estimated.
    """
    spec = spec.model_copy(update={"generations": 0, "refine": True})
    base = fit_group(setup, group, spec, Unseen(progress), named=False)
    labels = [e.label for e in base.fit.estimates]
    if name not in labels:
        raise InputError(f"{name!r} is not estimated; {did_you_mean(name, labels)}")
    walk = _Walk(setup, group, spec, progress, base, labels.index(name))
    threshold = float(chi2.ppf(level, 1))
    points = [walk.centre]
    for direction in (-1.0, 1.0):
        points += walk.outwards(direction, 2.0 * threshold, most)
    points.sort(key=lambda point: point.value)
    shown = [i for i, item in enumerate(walk.rest.items) if item.searched]
    return Profile(
        base.fit.estimates[walk.index], level, threshold,
        np.array([p.value for p in points]), np.array([walk.deviance(p) for p in points]),
        tuple(walk.rest.labels[i] for i in shown), np.array([p.vector[shown] for p in points]),
    )  # fmt: skip


@dataclass(frozen=True)
class _Point:
    """A value at which the parameter is held, and the best fit there."""

    value: float
    cost: float
    vector: np.ndarray


class _Walk:
    """Fits with one parameter held, each beginning at the last one's end."""

    def __init__(
        self, setup: Setup, group: Sequence[Recording], spec: IdentifySpec, progress: Progress,
        base: Fitted, index: int,
    ) -> None:  # fmt: skip
        self._setup, self._group, self._spec, self._progress = setup, group, spec, progress
        self.index, self._estimate = index, base.fit.estimates[index]
        unknowns = unknowns_with_starts(setup.model, spec, group, setup.outputs)
        self._held = unknowns.items[index]
        self.rest = Unknowns(unknowns.items[:index] + unknowns.items[index + 1 :])
        self._known = fixed_values(setup.model, spec, unknowns)
        self._count = base.fit.residual_count
        self.centre = _Point(self._estimate.value, base.fit.cost, np.delete(base.vector, index))
        self._step, self._scale = _first_step(self._estimate), 1.0
        self._first: dict[float, _Point] = {}
        if np.isfinite(self._estimate.std) and not progress.stopped():
            self._first = {d: self._next(self.centre, d * self._step) for d in (-1.0, 1.0)}
            self._scale = self._agreeing_scale()

    def _agreeing_scale(self) -> float:
        """That with which the deviance one standard deviation away is one."""
        moved = [p for p in self._first.values() if p.value != self.centre.value]
        seen = sum(self.deviance(p) for p in moved)
        due = sum(((p.value - self.centre.value) / self._step) ** 2 for p in moved)
        return due / seen if seen > 0.0 else 1.0

    def deviance(self, point: _Point) -> float:
        """Twice the loss of the logarithmic likelihood."""
        return self._scale * self._count * float(np.log(point.cost / self.centre.cost))

    def outwards(self, direction: float, enough: float, most: int) -> list[_Point]:
        """Points on one side, until the deviance is `enough` or a bound is reached."""
        points, step = [self.centre], direction * self._step
        first = self._first.get(direction)
        while len(points) <= most and not self._progress.stopped():
            point = first or self._next(points[-1], step)
            first = None
            if point.value == points[-1].value or self._progress.stopped():
                break  # at a bound, or a fit that somebody stopped
            points.append(point)
            if self.deviance(point) >= enough:
                break
            if self.deviance(point) - self.deviance(points[-2]) < 0.1 * enough:
                step *= 2.0  # a flat valley is long
        return points[1:]

    def _next(self, last: _Point, step: float) -> _Point:
        """The best fit a step further, within the bounds."""
        p = self._held.parameter
        value = float(np.clip(last.value + step, p.lower, p.upper))
        if value == last.value:
            return last
        items = tuple(
            replace(item, parameter=replace(item.parameter, value=float(x)))
            for item, x in zip(self.rest.items, last.vector, strict=True)
        )
        found = fit_group(
            self._setup, self._group, self._spec, Unseen(self._progress), False,
            {**self._known, p.name: value}, Unknowns(items),
        )  # fmt: skip
        self._progress.advance(1, f"{self._held.label} = {value:.6g}")
        return _Point(value, found.fit.cost, found.vector)


def _first_step(estimate: Estimate) -> float:
    """A standard deviation; a tenth of the value where the recordings leave it free."""
    if np.isfinite(estimate.std) and estimate.std > 0.0:
        return estimate.std
    return 0.1 * abs(estimate.value) or 1.0
