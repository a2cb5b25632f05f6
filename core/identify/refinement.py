"""Bounded least-squares refinement, from the beginning of each recording to its whole.

A vibration whose frequency is wrong by Df is out of step after 1 / (2 Df). Over a long recording
the cost therefore has many minima beside the true one, as near together as the recording is long,
and a descent from a stiffness that is a third off ends in one of them. Over the first few swings
there is one, and what it gives is near enough for twice the time, and so on. (A growing horizon, as
in A. Voss, J. Timmer, J. Kurths, Int. J. Bifurcation and Chaos 14, 2004, for multiple shooting.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError
from ..identify.predictor import Predictor
from ..identify.prepared_recording import Prepared, prepare
from ..identify.residuals import Residuals
from ..least_squares import Descended, Limits, cost_of, descend, limits_of
from ..progress import StoppedError
from ..recording.decimation import first_part

MOST_ITERATIONS = 60
"""Of a descent; most end after ten."""
TOLERANCE = 1e-14
"""Relative; the cost of noise-free data falls by twenty orders, so this is meant to be small."""

EXPENSIVE_TOLERANCE = 1e-8
"""Where simulations are dear: still far below any standard deviation of an estimate."""


@dataclass(frozen=True)
class RefinedFit:
    """Where the descent ended."""

    vector: np.ndarray
    cost: float
    """Sum of weighted squares, without the priors."""
    gradient: float
    """|J'r| of the scaled problem over |J||r|: the cosine of residual and sensitivities."""
    converged: bool
    stopped_at_once: bool = False
    """Whether somebody stopped before the first step was done."""
    slopes: tuple[np.ndarray, ...] = ()
    """The residuals' sensitivities (M, k, P) there, where the last step has found them."""


ROUNDS_WITH_PRIOR = 3
"""The noise level that scales the prior settles in two; the third confirms."""


OnStep = Callable[[float], bool]
"""Called with the cost after each step; True ends the descent where it is."""


def refine(
    residuals: Residuals, start: np.ndarray, on_step: OnStep, tolerance: float | None = None
) -> RefinedFit:
    """The least-squares minimum reached from `start` within the bounds; `tolerance` is relative
    and about the cost, and as strict as makes sense where none is given."""
    if tolerance is None:
        tolerance = EXPENSIVE_TOLERANCE if residuals.predictor.simulation_is_dear else TOLERANCE
    limits = limits_of(residuals.unknowns.parameters)
    vector, watched = np.asarray(start, dtype=float), _WatchedResiduals(residuals, on_step)
    for _ in range(ROUNDS_WITH_PRIOR if _has_prior(limits) else 1):
        try:
            found = descend(
                watched.errors, watched.slopes, vector, scaled_limits(residuals, vector, limits),
                watched.stopped, MOST_ITERATIONS, 0.0, share=tolerance,
            )  # fmt: skip
        except StoppedError:
            return RefinedFit(watched.vector, watched.cost, np.nan, False, watched.cost == np.inf)
        vector = found.vector
    return fit_at(residuals, found)


def _has_prior(limits: Limits) -> bool:
    return bool(np.isfinite(limits.deviations).any())


def scaled_limits(residuals: Residuals, vector: np.ndarray, limits: Limits) -> Limits:
    """The limits with the deviations of a prior in units of the residuals' own level."""
    if not _has_prior(limits):
        return limits
    level = float(np.sqrt(np.mean(residuals(vector) ** 2)))
    return replace(limits, deviations=limits.deviations / (level or 1.0))


def fit_at(residuals: Residuals, found: Descended) -> RefinedFit:
    """Where a descent of the residuals ended."""
    r, J = residuals.vector(found.blocks), residuals.vector(found.slopes) * residuals.scales
    size = np.linalg.norm(J) * np.linalg.norm(r)
    gradient = float(np.linalg.norm(J.T @ r) / size) if size > 0.0 else 0.0
    return RefinedFit(found.vector, found.cost, gradient, found.ended)


@dataclass
class _WatchedResiduals:
    """Residuals and slopes for a descent, and the best that it has come to."""

    residuals: Residuals
    on_step: OnStep
    vector: np.ndarray = field(default_factory=lambda: np.zeros(0))
    cost: float = np.inf

    def errors(self, x: np.ndarray) -> list[np.ndarray]:
        blocks = self.residuals.blocks(x)
        cost = cost_of(blocks)
        if cost < self.cost or not self.vector.size:
            self.vector, self.cost = np.array(x), cost
            self.residuals.report(self.vector, cost)
        return blocks

    def slopes(self, x: np.ndarray) -> list[np.ndarray]:
        dear = self.residuals.predictor.simulation_is_dear
        return self.residuals.sensitivities(x, central=not dear)

    def stopped(self) -> bool:
        return self.on_step(self.cost)


SHARES = (1 / 16, 1 / 8, 1 / 4, 1 / 2)
"""Of each recording. A stiffness that is wrong by 30 % puts a vibration out of step after three
swings; benches are recorded over some dozens."""

FEWEST_PER_UNKNOWN = 8
"""Samples that count per unknown, below which a beginning says nothing of all of them."""

HORIZON_TOLERANCE = 1e-2
"""Relative fall of the cost at which a descent ends: the next one takes more of the recording."""


def start_over_horizon(residuals: Residuals, start: np.ndarray, on_step: OnStep) -> np.ndarray:
    """From where a descent over whole recordings is to begin; (P,) as `start`."""
    if all(e.model.arm.coordinates == e.model.arm.joints for e in residuals.experiments):
        return start  # what does not swing does not run out of step
    vector = start
    for share in SHARES:
        parts = first_parts(residuals.experiments, share)
        counted = sum(int(e.counted.sum()) for e in parts)
        if counted < FEWEST_PER_UNKNOWN * len(vector):
            continue
        found = refine(_with_experiments(residuals, parts), vector, on_step, HORIZON_TOLERANCE)
        if found.stopped_at_once or not np.isfinite(found.cost):
            break
        vector = found.vector
    return vector


SEARCH_SAMPLES = 30_000
"""Samples of all recordings together, on which a search over a population takes a few seconds; of
longer ones it takes the beginnings."""


def first_samples_of(residuals: Residuals, most: int) -> Residuals:
    """The same over the beginnings of the recordings, with `most` samples of all together; as it is
    where there are no more."""
    samples = sum(len(e.recording.time) for e in residuals.experiments)
    parts = first_parts(residuals.experiments, most / samples) if samples > most else []
    return _with_experiments(residuals, parts) if parts else residuals


def _with_experiments(residuals: Residuals, experiments: Sequence[Prepared]) -> Residuals:
    """The same of other experiments."""
    known = residuals.predictor
    predictor = Predictor(experiments, known.unknowns, known.fixed, steps=known.steps)
    return Residuals(predictor, residuals.weights, on_better=residuals.on_better)


def first_parts(experiments: Sequence[Prepared], share: float) -> list[Prepared]:
    """The first `share` of each recording, ready for the same model; none where nothing of one
    counts."""
    found = []
    for e in experiments:
        part = first_part(e.recording, int(np.ceil(share * len(e.recording.time))))
        try:
            found.append(prepare(e.model, part, e.outputs, e.processing))
        except InputError:
            return []
    return found
