"""The minimum of a model, with as many steps per sample as it needs, and out of the valleys that a
missing effect led into."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from core.diagnose.data import Anchor, Data, Hypothesis, again, coarser
from core.diagnose.refit import Refit, fit, settled, whitened
from core.diagnose.starts import from_nominal_values
from core.diagnose.whitening import Whitener
from core.identify.held import steps_needed
from core.identify.predictor import on_all_cores
from core.least_squares import (
    MOST_ITERATIONS,
    cost_of,
    descend,
    normal_equations,
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
    bare = replace(data, anchor=None)
    errors, finer = _with_each(bare, h, (steps, 2 * steps))
    while steps < MOST_FINE:
        change = cost_of([a - b for a, b in zip(finer, errors, strict=True)])
        if change < SAME**2 * data.count:
            break
        steps, errors, finer = 2 * steps, finer, _with_steps(bare, h, 4 * steps)
    return replace(data, anchor=Anchor(h, _richardson(errors, finer)), fine=steps), errors


def _richardson(coarse: Sequence[np.ndarray], fine: Sequence[np.ndarray]) -> list[np.ndarray]:
    """From errors (M, k) with some steps and twice as many: the method is of second order."""
    return [(4.0 * b - a) / 3.0 for a, b in zip(coarse, fine, strict=True)]


def _with_each(data: Data, h: Hypothesis, steps: Sequence[int]) -> list[list[np.ndarray]]:
    """The errors with each number of steps, side by side: of a few recordings one simulation keeps
    one core busy."""
    return list(on_all_cores(lambda n: _with_steps(data, h, n), steps))


def _with_steps(data: Data, h: Hypothesis, steps: int) -> list[np.ndarray]:
    residuals = replace(h.residuals, predictor=coarser(h.residuals.predictor, steps))
    return residuals.blocks(h.vector)


MOST_DESCENTS = 4
"""From one minimum with its steps corrected to the next; two are usual."""

RELEVANT_REDUCTION = 0.04
"""Per sample, in floors squared: what one descent more may still gain without a word, as
core.diagnose.evidence.RELEVANT."""


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
        if stopped() or not gained > RELEVANT_REDUCTION * data.count:
            break
        before = errors
    return data, _at(data, found, errors, whitener)


def _at(data: Data, found: Refit, errors: Sequence[np.ndarray], whitener: Whitener | None) -> Refit:
    at = replace(found.descended, blocks=tuple(errors), cost=cost_of(errors))
    h = again(data, found.hypothesis, finer=1)
    white, _ = whitened(h, at, whitener) if whitener is not None else (at.cost, None)
    return settled(Refit(h, at, white, found.covariance))


LAST_ITERATIONS = 15
"""With exact directions a descent that begins near its end needs two or three; what showed in too
fast a vibration for the steps of the search may still be some way off."""

LAST_REDUCTION = 0.1
"""Reduction of the squared error, in mean squares of what is left, below which the last descent
ends: a parameter that is one deviation off costs one."""


def precise(data: Data, refit: Refit, stopped: Callable[[], bool]) -> tuple[Data, Refit]:
    """The same minimum to within a small share of the deviations that are stated.

    For a ranking a descent may take directions from half the steps and end where a further step
    gains next to nothing per sample; over thousands of samples that can be many deviations. So can
    what the steps themselves miss, which is extrapolated here.
    """
    h = _extrapolated(data, refit)
    found = descend(
        h.errors, h.exact_slopes, h.vector, h.limits, stopped, most=LAST_ITERATIONS,
        good_enough=LAST_REDUCTION * refit.cost / data.count**2, keep=True,
    )  # fmt: skip
    if not np.isfinite(found.cost) or found.cost > refit.cost + RELEVANT_REDUCTION * data.count:
        return data, refit
    at = refit.hypothesis.at(found.vector)
    data, errors = anchored(data, at)  # what is stated is what page and report show: no mix of two
    return data, _at(data, Refit(at, found, found.cost, refit.covariance), errors, None)


MOST_DOUBLINGS = 2
"""Of the steps, beyond those from which on more change no word: friction has edges, with which they
would go on for ever."""

UNMOVED = 0.0025
"""Squared move of the parameters by twice the steps, in their deviations, whatever the direction:
less than a twentieth of one."""


def _extrapolated(data: Data, refit: Refit) -> Hypothesis:
    """The model with its steps' own error, extrapolated by Richardson, taken off: from so many that
    twice as many move no parameter by more than a share of its deviation. It descends with half as
    many: so near its minimum what is taken off hardly changes."""
    bare = replace(data, anchor=None)
    h = again(replace(bare, steps=data.fine or 1), refit.hypothesis, finer=1)
    steps = h.steps or 1
    runs = _with_each(bare, h, (steps, 2 * steps, 4 * steps))
    left = MOST_DOUBLINGS
    while True:
        coarse, better = (_richardson(*pair) for pair in (runs[:2], runs[1:]))
        missed = _left_by(runs, coarse, better, refit)
        if missed < UNMOVED or not left:
            break
        # Where edges, which halve it each time, will ask for two more, both are made side by side.
        more = min(left, 2 if missed > 4.0 * UNMOVED else 1)
        finer = _with_each(bare, h, [4 * steps * 2**k for k in range(1, more + 1)])
        runs, steps, left = [*runs[more:], *finer], steps * 2**more, left - more
    h = again(replace(bare, steps=steps), h, finer=1)
    return replace(h, anchor=Anchor(h, better))


QUARTERED = 0.3
"""Between the quarter and the half of what steps twice as long move a smooth motion and one with
edges."""


def _left_by(
    runs: Sequence[list[np.ndarray]],
    coarse: Sequence[np.ndarray],
    better: Sequence[np.ndarray],
    refit: Refit,
) -> float:
    """Squared move of the parameters, in their deviations, by what extrapolation still leaves.

    Where half the step leaves a quarter, as of a smooth motion, the extrapolated is of fourth order
    and its next change a sixteenth of the last one: a fifteenth is left. Edges leave all of it.

    Args:
        runs: errors (M, k) with some steps, twice and four times as many.
        coarse: the first two extrapolated; `better`: the last two.
    """
    first, second, last = (
        _moved([a - b for a, b in zip(*pair, strict=True)], refit)
        for pair in ((runs[0], runs[1]), (runs[1], runs[2]), (coarse, better))
    )
    return last / 15.0**2 if second < QUARTERED**2 * first else last


def _moved(change: Sequence[np.ndarray], refit: Refit) -> float:
    """Squared move of the minimum, in its deviations, by a change (M, k) of the errors: the part of
    it that lies along the slopes, in mean squares of what is left."""
    if not len(refit.hypothesis.vector):
        return 0.0
    A, b = normal_equations(change, refit.descended.slopes)
    d = np.sqrt(np.maximum(np.diag(A), 1e-300))
    inverse = np.linalg.pinv(A / np.outer(d, d), rcond=1e-10, hermitian=True)
    count = sum(e.size for e in refit.errors)
    return float((b / d) @ inverse @ (b / d)) * count / max(refit.cost, 1e-300)
