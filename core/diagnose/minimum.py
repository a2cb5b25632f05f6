"""The minimum of a model, with as many steps per sample as it needs, and out of the valleys that a
missing effect led into."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from core.diagnose.data import Data, Hypothesis, again
from core.diagnose.evidence import RELEVANT
from core.diagnose.refit import Refit, fit, settled, whitened
from core.diagnose.starts import from_nominal_values
from core.diagnose.whitening import Whitener
from core.identify.defect_correction import (
    Anchor,
    corrected_minimum,
    errors_with,
    errors_with_each,
    extrapolated,
)
from core.identify.held import steps_needed
from core.least_squares import (
    MOST_ITERATIONS,
    cost_of,
)

SAME = 0.05
"""In floors, rms: by less than this more steps change nothing."""

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
