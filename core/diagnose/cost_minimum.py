"""The minimum of a model, with as many steps per sample as it needs, and out of the valleys that a
missing effect led into; what idealised laws may miss there, and deviations where the encoders'
noise shakes the arm.

Where a servo leads the joints, that noise sets lightly damped links swinging, and they swing for
the whole recording at the frequency by which a stiffness shows. A fit takes most of that up, so the
residual does not show it: what the noise does to the estimates is drawn, with the model's own
equations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..diagnose.evidence import RELEVANT
from ..diagnose.fit_problem import Data, Hypothesis, again, hypothesis
from ..diagnose.output_noise import noise_drawn
from ..diagnose.refit import Refit, fit, settled, whitened
from ..diagnose.refit_starts import from_nominal_values
from ..diagnose.remaining_error import channel_rms
from ..diagnose.whitening import Whitener
from ..identify.defect_correction import (
    Anchor,
    corrected_minimum,
    errors_with,
    errors_with_each,
    extrapolated,
)
from ..identify.held import steps_needed
from ..least_squares import (
    MOST_ITERATIONS,
    cost_of,
    pseudo_inverse,
)

SAME = 0.05
"""In noise floors, rms: by less than this more steps change nothing."""

MOST_FINE = 256
"""Steps per sample."""


def anchored(data: Data, h: Hypothesis) -> tuple[Data, list[np.ndarray]]:
    """The data with the error of few steps taken from a model at its vector, and the model's
    errors (M, k) with as many steps as it takes until more of them change nothing.

    What is taken off is extrapolated from the last two: over thousands of samples a twentieth of a
    floor is significant, and gave a complete model p-values of a billionth.
    """
    dt = max(e.recording.sample_time for e in data.experiments)
    assert data.steps is not None
    steps = max(data.fine or 0, steps_needed(h.model, dt, 2 * data.steps, 1.0))
    errors, finer = errors_with_each(h.residuals, h.vector, (steps, 2 * steps))
    while steps < MOST_FINE:
        change = cost_of([a - b for a, b in zip(finer, errors, strict=True)])
        if change < SAME**2 * data.count:
            break
        steps, errors, finer = 2 * steps, finer, errors_with(h.residuals, h.vector, 4 * steps)
    anchor = Anchor(replace(h.residuals, anchor=None), h.vector, extrapolated(errors, finer))
    return replace(data, anchor=anchor, fine=steps), errors


MOST_DESCENTS = 4
"""From one minimum with its steps corrected to the next; two are usual."""


def converged(
    data: Data, h: Hypothesis, whitener: Whitener | None, stopped: Callable[[], bool]
) -> tuple[Data, Refit]:
    """The minimum near a hypothesis with as many steps as it needs, and the data anchored there.

    What few steps miss is taken off as it was where the descent began. Far from there correction
    and directions no longer fit (an elastic joint stopped at three times the error of its
    minimum), so the descent begins anew from where it ended until that gains nothing.
    """
    data, found = _descended(data, h, whitener, stopped)
    for elsewhere in (_off_bounds, _other_valley):
        start = elsewhere(data, found.hypothesis, stopped)
        if start is not None and not stopped():
            other = _descended(replace(data, anchor=None), start, whitener, stopped)
            if other[1].cost < found.cost:
                data, found = other
    return data, found


def _other_valley(data: Data, h: Hypothesis, stopped: Callable[[], bool]) -> Hypothesis | None:
    """The same where the first swings lead, if that leaves less of the whole recordings: a fit that
    lacked an effect may have left the valley. None where nothing better is found."""
    values = from_nominal_values(data, h, stopped)
    if values is None:
        return None
    bare = replace(data, anchor=None)
    here, there = again(bare, h, finer=1), again(bare, h, values, finer=1)
    lower = cost_of(there.errors(there.vector)) < cost_of(here.errors(here.vector))
    return there if lower else None


NEAR = 0.05
"""Share of a bound within which a nominal parameter no longer says anything: a beam ten times too
stiff is a rigid one, and hardly moves an output."""


def _off_bounds(data: Data, h: Hypothesis, stopped: Callable[[], bool]) -> Hypothesis | None:
    """The same with the nominal values of what ended at a bound while an effect was missing: there
    the error is flat, and no descent leads back. None where nothing did."""
    at, moved = h.values(), dict[str, float]()
    for u in data.nuisance:
        p, x = u.parameter, at.get(u.label, u.parameter.value)
        near = x > (1.0 - NEAR) * p.upper or x < (1.0 + NEAR) * p.lower
        if u.recording is None and p.positive and near:
            moved[u.label] = p.value
    return again(data, h, moved, finer=1) if moved else None


def _descended(
    data: Data, h: Hypothesis, whitener: Whitener | None, stopped: Callable[[], bool]
) -> tuple[Data, Refit]:
    data, before = anchored(data, h)
    for _ in range(MOST_DESCENTS):
        start = again(data, h, finer=1)
        found = fit(start, whitener, stopped, MOST_ITERATIONS, exactly_downhill=True)
        data, errors = anchored(data, found.hypothesis)
        h = found.hypothesis
        gained = cost_of(before) - cost_of(errors)
        if stopped() or not gained > RELEVANT * data.count:
            break
        before = errors
    return data, _at(data, found, errors, whitener)


def _at(data: Data, found: Refit, errors: Sequence[np.ndarray], whitener: Whitener | None) -> Refit:
    at = replace(found.descended, blocks=tuple(errors), cost=cost_of(errors))
    h = again(data, found.hypothesis, finer=1)
    white, _ = whitened(h, at, whitener) if whitener is not None else (at.cost, None)
    return settled(Refit(h, at, white, found.covariance))


def precise(data: Data, refit: Refit, stopped: Callable[[], bool]) -> tuple[Data, Refit]:
    """The same minimum to within a small share of the deviations that are stated.

    For a ranking a descent may take directions from half the steps and end where a further step
    gains next to nothing per sample; over thousands of samples that can be many deviations. So can
    what the steps themselves miss, which is extrapolated here.
    """
    h = again(replace(data, anchor=None, steps=data.fine or 1), refit.hypothesis, finer=1)
    slopes = refit.descended.slopes
    _, found = corrected_minimum(h.residuals, h.vector, slopes, h.limits, stopped)
    if not np.isfinite(found.cost) or found.cost > refit.cost + RELEVANT * data.count:
        return data, refit
    at = refit.hypothesis.at(found.vector)
    data, errors = anchored(data, at)  # what is stated is what page and report show: no mix of two
    return data, _at(data, Refit(at, found, found.cost, refit.covariance), errors, None)


def missed_by_laws(data: Data, refit: Refit) -> dict[str, float]:
    """channel -> mean square, in floors, that the laws of the model's effects may miss: of each the
    share that it states of what it does to the outputs, everything else as it is."""
    h, missed = refit.hypothesis, dict[str, float]()
    for one in h.model.effects:
        if not one.idealised:
            continue
        rest = [e for e in h.model.effects if e is not one and one.kind not in e.includes]
        without = hypothesis(data, rest, {**h.model.effect_values, **h.values()})
        for name, rms in _change(data, without.errors(without.vector), refit.errors).items():
            missed[name] = missed.get(name, 0.0) + (one.idealised * rms) ** 2
    return missed


def _change(data: Data, a: Sequence[np.ndarray], b: Sequence[np.ndarray]) -> dict[str, float]:
    """channel -> rms in floors of what changes between two models."""
    return channel_rms(data.experiments, [x - y for x, y in zip(a, b, strict=True)])


DRAWN = 24
"""Of all recordings together: a variance of so many draws is good to a third, and deviations of it
hold nearly as often as if it were known (2.06 of them for 1.96; of six draws 2.45)."""


def widened(data: Data, refit: Refit, stated: Mapping[str, float]) -> Refit:
    """The fit with deviations that are no smaller than what draws of the noise make of them.

    Args:
        data: recordings along which a servo leads the joints.
        refit: a model at its minimum.
        stated: column -> standard deviation of the sensor's noise, SI, where it is known.
    """
    C = refit.covariance
    known = np.flatnonzero(np.isfinite(np.diag(C)))
    if not len(known):
        return refit
    drawn = _variances(data, refit, known, stated)
    wider = np.ones(len(C))
    wider[known] = np.sqrt(np.maximum(drawn / np.maximum(np.diag(C)[known], 1e-300), 1.0))
    return replace(refit, covariance=C * np.outer(wider, wider))


def _variances(
    data: Data, refit: Refit, known: np.ndarray, stated: Mapping[str, float]
) -> np.ndarray:
    """(p,) of the unknowns `known`: of (S'S)^-1 S'e over draws e, which recordings make apart. A
    channel's draws are at most its noise floor, where the model has shown that its columns are less
    noisy than they seemed."""
    h = refit.hypothesis
    slopes = [S[:, :, known].reshape(-1, len(known)) for S in refit.descended.slopes]
    inverse = pseudo_inverse(np.asarray(sum(S.T @ S for S in slopes)))
    meat = np.zeros_like(inverse)
    experiments, motions = h.residuals.experiments, h.motions()
    drawn = [
        np.array([x * weights for x in draws])
        for draws, weights in zip(
            noise_drawn(experiments, motions, stated, DRAWN), data.weights, strict=True
        )
    ]
    sizes = channel_rms(experiments, [np.sqrt(np.mean(x**2, axis=0)) for x in drawn])
    most = np.array([1.0 / max(sizes.get(n, 0.0), 1.0) for n, _ in experiments[0].channels])
    for S, draws in zip(slopes, drawn, strict=True):
        pulls = np.array([S.T @ (x * most).ravel() for x in draws])
        meat += pulls.T @ pulls / len(pulls)
    return np.diag(inverse @ meat @ inverse)
