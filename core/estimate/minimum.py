"""The cost minimum of a model: enough steps per sample, other minima, standard deviations.

With a virtual servo, encoder noise excites lightly damped links for the whole recording, at the
frequency that determines a stiffness. A fit absorbs most of it, so the residual does not show it.
Its effect on the estimates is simulated with draws of the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..effects.effect import Effect
from ..estimate.fit_result import FitResult, fit, whitened_cost, with_robust_covariance
from ..estimate.problem import FitData, Problem, problem_of, with_values, within_noise
from ..estimate.starts import differs_from_nominal, nominal_values
from ..identify.defect_correction import (
    MOST_STEPS,
    Anchor,
    corrected_minimum,
    errors_with,
    errors_with_each,
    extrapolated,
    is_minimum,
    minimum_along,
    with_enough_steps,
)
from ..identify.prescribed_joint_forces import steps_between_points
from ..identify.refinement import starts_over_horizon
from ..least_squares import cost_of, pseudo_inverse
from ..noise.noise_floor import channel_rms
from ..noise.output_noise import simulate_noise
from ..noise.whitening import Whitener

RELEVANT = 0.04
"""Least explained squared error per sample, in squared noise floors: 0.2 of the noise floor's rms.
With thousands of samples far less is significant, but not relevant."""

SAME = 0.05
"""In noise floors, or in what the model leaves if that is more, rms: a smaller change by more steps
is negligible."""


def anchor_at(data: FitData, problem: Problem) -> tuple[FitData, list[np.ndarray]]:
    """The data with the step error of a model at its vector, and the model's errors (M, k) with
    enough steps. The search's steps are doubled until the model's simulation does not diverge: a
    play's contacts need more than the joints before it.

    The correction is extrapolated from two numbers of steps. Over thousands of samples a twentieth
    of a noise floor is significant: it gave a complete model p-values of 1e-9.
    """
    dt = max(e.recording.sample_time for e in data.experiments)
    steps = max(data.result_substeps, steps_between_points(problem.model, dt, 2 * data.substeps))
    errors, finer = errors_with_each(problem.residuals, problem.vector, (steps, 2 * steps))
    while steps < MOST_STEPS:
        change = cost_of([a - b for a, b in zip(finer, errors, strict=True)])
        if change < SAME**2 * max(cost_of(finer), data.count):
            break
        steps, errors, finer = (
            2 * steps,
            finer,
            errors_with(problem.residuals, problem.vector, 4 * steps),
        )
    anchor = Anchor(
        replace(problem.residuals, anchor=None), problem.vector, extrapolated(errors, finer)
    )
    few = data.anchored_substeps
    while few < steps and anchor.has_diverged(steps_between_points(problem.model, dt, few)):
        few *= 2
    return replace(data, anchor=anchor, anchored_substeps=few, result_substeps=steps), errors


MOST_DESCENTS = 4
"""Descents, each with a new step correction; two are usual."""


def converge(
    data: FitData, problem: Problem, whitener: Whitener | None, stopped: Callable[[], bool]
) -> tuple[FitData, FitResult]:
    """The minimum near a model with enough steps, and the data anchored there.

    The step correction is that of the start of a descent. Far from there it and the directions are
    wrong (an elastic joint stopped at three times its minimal error). So the descent restarts from
    its end until that gains nothing.
    """
    data, refit = _descend(data, problem, whitener, stopped)
    if within_noise(data, refit.errors) or stopped():
        return data, refit
    start = other_start(replace(data, anchor=None), refit.problem, stopped)
    if start is not None and not stopped():
        other = _descend(replace(data, anchor=None), start, whitener, stopped)
        if other[1].cost < refit.cost:
            return other
    return data, refit


NEAR = 0.01
"""Of the range between the bounds, in logarithms, next to a bound: there a nominal parameter has no
influence, as a beam ten times too stiff is rigid."""


def other_start(data: FitData, problem: Problem, stopped: Callable[[], bool]) -> Problem | None:
    """The model from nominal values, where a fit that lacked an effect may have ended beside the
    minimum: a parameter stands at a bound, where the cost is flat, or an arm that vibrates is out
    of step, which the first vibrations show. Else None."""
    at, moved = problem.values(), dict[str, float]()
    nominal = {u.label: u.parameter for u in data.nuisance if u.recording is None}
    for label, p in nominal.items():
        if p.positive:
            share = np.log(at.get(label, p.value) / p.lower) / np.log(p.upper / p.lower)
            moved |= {} if NEAR < share < 1.0 - NEAR else {label: p.value}
    if moved:
        return with_values(data, problem, moved, refine=1)
    arm = problem.model.arm
    if arm.coordinates == arm.joints or not differs_from_nominal(data, at):
        return None
    start = with_values(data, problem, nominal_values(data), refine=1)
    (vector,) = starts_over_horizon(start.residuals, [start.vector], lambda _: stopped())
    here = with_values(data, problem, refine=1)
    fall = cost_of(here.errors(here.vector)) - cost_of(start.errors(vector))
    return start.at(vector) if fall > RELEVANT * data.count else None


def _descend(
    data: FitData, problem: Problem, whitener: Whitener | None, stopped: Callable[[], bool]
) -> tuple[FitData, FitResult]:
    data, before = anchor_at(data, problem)
    for _ in range(MOST_DESCENTS):
        start = with_values(data, problem, refine=1)
        refit = fit(start, whitener, stopped, exact_directions=True)
        data, errors = anchor_at(data, refit.problem)
        problem = refit.problem
        gained = cost_of(before) - cost_of(errors)
        if stopped() or not gained > RELEVANT * data.count:
            break
        before = errors
    return data, _refit_at(data, refit, errors, whitener)


def _refit_at(
    data: FitData, refit: FitResult, errors: Sequence[np.ndarray], whitener: Whitener | None
) -> FitResult:
    descended = replace(refit.descended, blocks=tuple(errors), cost=cost_of(errors))
    problem = with_values(data, refit.problem, refine=1)
    whitened, _ = (
        whitened_cost(problem, descended, whitener)
        if whitener is not None
        else (descended.cost, None)
    )
    return with_robust_covariance(FitResult(problem, descended, whitened, refit.covariance))


def converge_precisely(
    data: FitData, refit: FitResult, stopped: Callable[[], bool]
) -> tuple[FitData, FitResult]:
    """The same minimum to within a small share of the stated standard deviations.

    For a ranking, a descent may use half the steps and end early; over thousands of samples that
    can be many standard deviations. So can the step error, which is extrapolated here.
    """
    problem = with_values(replace(data, anchor=None), refit.problem, refine=1)
    slopes = refit.descended.slopes
    _, descended = corrected_minimum(
        problem.residuals, problem.vector, slopes, problem.limits, stopped
    )
    if not np.isfinite(descended.cost) or descended.cost > refit.cost + RELEVANT * data.count:
        return data, refit
    # What is stated is what page and report show: no mix of two numbers of steps.
    for _ in range(MOST_DESCENTS):
        at = refit.problem.at(descended.vector)
        data, errors = anchor_at(data, at)
        end = FitResult(at, descended, descended.cost, refit.covariance)
        # Where the errors are bent, a step along the slopes before it leads a part of the way.
        further = minimum_along(descended.slopes, errors, at.vector, at.limits)
        if stopped() or is_minimum(at.vector, further):
            break
        descended = further
    return data, _refit_at(data, end, errors, None)


def law_error(data: FitData, refit: FitResult) -> dict[str, float]:
    """channel -> mean square, in noise floors, that the idealised laws of the model's effects may
    miss: for each effect its stated share of its change of the outputs."""
    problem, missed = refit.problem, dict[str, float]()
    for effect in problem.model.effects:
        if not effect.idealised:
            continue
        others = [
            e for e in problem.model.effects if e is not effect and effect.kind not in e.includes
        ]
        without = problem_of(data, others, problem.all_values())
        for name, rms in _change(data, without.errors(without.vector), refit.errors).items():
            missed[name] = missed.get(name, 0.0) + (effect.idealised * rms) ** 2
    return missed


def _change(data: FitData, a: Sequence[np.ndarray], b: Sequence[np.ndarray]) -> dict[str, float]:
    """channel -> rms difference of two models' errors, in noise floors."""
    return channel_rms(data.experiments, [x - y for x, y in zip(a, b, strict=True)])


NOISE_DRAWS = 24
"""Draws for all recordings together: a variance from so many is good to a third, and 2.06 of its
standard deviations hold as often as 1.96 of a known one (2.45 with six draws)."""


def with_simulated_deviations(
    data: FitData, refit: FitResult, stated: Mapping[str, float]
) -> FitResult:
    """The fit at its minimum, along recordings in which a servo leads the joints, with standard
    deviations at least as large as draws of the noise give. `stated`: column -> standard deviation
    of the sensor's noise, SI, where it is known."""
    C = refit.covariance
    finite = np.flatnonzero(np.isfinite(np.diag(C)))
    if not len(finite):
        return refit
    drawn = _variances(data, refit, finite, stated)
    wider = np.ones(len(C))
    wider[finite] = np.sqrt(np.maximum(drawn / np.maximum(np.diag(C)[finite], 1e-300), 1.0))
    return replace(refit, covariance=C * np.outer(wider, wider))


def _variances(
    data: FitData, refit: FitResult, which: np.ndarray, stated: Mapping[str, float]
) -> np.ndarray:
    """(p,) variances of the unknowns `which`: of (S'S + K)^-1 (S'e + k) over draws e, by recording,
    and draws k of what is known a priori, with the covariance K. A channel's draws are limited to
    its noise floor, in case the model showed less noise."""
    problem = refit.problem
    slopes = [S[:, :, which].reshape(-1, len(which)) for S in refit.descended.slopes]
    meat = np.diag(problem.limits.prior_measurements(problem.vector)[1][which] ** 2)
    inverse = pseudo_inverse(sum((S.T @ S for S in slopes), meat))
    experiments, motions = problem.residuals.experiments, problem.motions()
    drawn = [
        np.array([x * weights for x in draws])
        for draws, weights in zip(
            simulate_noise(experiments, motions, stated, NOISE_DRAWS), data.weights, strict=True
        )
    ]
    sizes = channel_rms(experiments, [np.sqrt(np.mean(x**2, axis=0)) for x in drawn])
    most = np.array([1.0 / max(sizes.get(n, 0.0), 1.0) for n, _ in experiments[0].channels])
    for S, draws in zip(slopes, drawn, strict=True):
        pulls = np.array([S.T @ (x * most).ravel() for x in draws])
        meat += pulls.T @ pulls / len(pulls)
    return np.diag(inverse @ meat @ inverse)


SEARCH_ERROR = 0.6
"""In noise floors, rms: a smaller step error in the search is negligible. `Anchor` corrects it and
leaves about a tenth (measured with friction, elastic joints, lag and damping)."""

LEAST_COSINE = 0.9
"""Least cosine between an unknown's sensitivity with some steps and with twice as many. A step
along a direction this far off still takes eight tenths (its square) of the possible reduction. With
a link at half the sampling rate, one step per sample and a cosine of -0.2, a stiffness stopped 8
per cent off and a soft base was named."""


def with_enough_substeps(
    data: FitData, effects: Sequence[Effect], values: Mapping[str, float], factor: int = 1
) -> FitData:
    """The data with `factor` times the steps that a model needs, half of them for models whose step
    error the anchor corrects, and with as many as directions need. (Errors that are compared take
    twice as many: core.estimate.fit_result.COMPARED_SUBSTEPS.)"""
    steps = factor * enough_substeps(data, effects, values)
    few = substeps_for_directions(data, effects, values, max(steps // 2, 1))
    return replace(data, substeps=max(steps, few), anchored_substeps=few)


def enough_substeps(data: FitData, effects: Sequence[Effect], values: Mapping[str, float]) -> int:
    """Steps per sample, such that twice as many change the outputs by less than SEARCH_ERROR, or by
    a small share of what the model leaves; and a quarter of them, with which a screen tries what
    changes an anchored model, hold together."""
    problem = problem_of(replace(data, substeps=1, anchor=None), effects, values)
    residuals, vector = problem.residuals, problem.vector
    steps = with_enough_steps(residuals, vector, SEARCH_ERROR**2 * data.count).predictor.steps
    while steps < MOST_STEPS:
        if np.isfinite(cost_of(errors_with(residuals, vector, max(steps // 4, 1)))):
            break
        steps *= 2
    return steps // problem.substeps


def substeps_for_directions(
    data: FitData, effects: Sequence[Effect], values: Mapping[str, float], least: int
) -> int:
    """Steps per sample, from `least` on, for reliable descent directions: twice as many change the
    shared sensitivities little."""
    half = max(least // 2, 1)  # of the steps are what directions are taken with
    slopes = _slopes(data, effects, values, half)
    while 2 * half < MOST_STEPS:
        finer = _slopes(data, effects, values, 2 * half)
        if _least_cosine(slopes, finer) > LEAST_COSINE:
            break
        half, slopes = 2 * half, finer
    return max(least, 2 * half) if half > 1 else least


def _slopes(
    data: FitData, effects: Sequence[Effect], values: Mapping[str, float], steps: int
) -> list[np.ndarray]:
    """Sensitivity (N,) to each shared unknown, with so many steps per sample."""
    problem = problem_of(replace(data, substeps=steps, anchor=None), effects, values)
    shared = [k for k, u in enumerate(problem.unknowns.items) if u.recording is None]
    if not shared:
        return []
    slopes = problem.residuals.slopes(problem.vector, central=False, only=shared)
    return [np.concatenate([S[:, :, k].ravel() for S in slopes]) for k in shared]


def _least_cosine(first: Sequence[np.ndarray], second: Sequence[np.ndarray]) -> float:
    """Least cosine of pairs of non-zero vectors (N,), NaN where a simulation diverged; one if there
    are none."""
    sizes = [np.linalg.norm(a) * np.linalg.norm(b) for a, b in zip(first, second, strict=True)]
    cosines = [a @ b / s for a, b, s in zip(first, second, sizes, strict=True) if s != 0.0]
    return float(np.min(cosines)) if cosines else 1.0
