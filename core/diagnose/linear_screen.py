"""The linear screen: which candidates explain the residual, nuisance projected out (as in Q. Zhang,
M. Basseville, A. Benveniste, Automatica 30, 1994)."""

from __future__ import annotations

from collections.abc import Callable, Container, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy

from ..diagnose.force_shape_refinement import best_force_shape, joint_force_shape
from ..diagnose.gram_matrix import NO_OUTPUT, GramMatrix, explained_by, gram_matrix
from ..diagnose.output_changes import (
    BaseErrors,
    Changes,
    OutputChange,
    Trial,
    as_small_as,
    needs_compilation,
    simulate_output_changes,
    trials,
)
from ..effects.effect import Effect
from ..estimate.problem import FitData, Problem
from ..identify.residuals import BATCH
from ..least_squares import as_finite
from ..noise.whitening import Whitener, fit_whitener, no_whitening, whitened_rows
from ..processors import thread_pool


@dataclass(frozen=True)
class ScreenedCandidate:
    """One candidate in the screen."""

    effect: Effect
    score: float
    """Whitened score LM: chi-squared with `degrees_of_freedom` degrees if the effect is absent."""
    degrees_of_freedom: int
    trial_count: float
    """Choices of sizes and shapes among which this one is the best."""
    p_value: float
    """Corrected for the number of trials."""
    cost_reduction: float
    """Expected reduction of the squared error, in squared noise floors."""
    largest_reduction: float
    """The largest expected reduction; its sizes need not be those of the best score."""
    values: Mapping[str, float]
    """Start values of a refit."""
    output_changes: tuple[int, ...]
    """Indices of the output changes that were combined."""
    parameters: tuple[str, ...]
    """The sizes that were combined."""
    scanned: tuple[str, ...]
    """Parameters among `values` that come from a grid, shape parameters too."""
    prediction: tuple[np.ndarray, ...]
    """(M, k) per recording, in noise floors: the residual that the effect predicts."""


@dataclass(frozen=True)
class Screen:
    """The screen of one round."""

    candidates: tuple[ScreenedCandidate, ...]
    """Best first."""
    whitened: GramMatrix
    unwhitened: GramMatrix
    whitener: Whitener
    errors: tuple[np.ndarray, ...]
    """The base's errors (M, k) per recording, in floors."""
    slopes: tuple[np.ndarray, ...]
    output_changes: tuple[OutputChange, ...]
    remainders: tuple[np.ndarray, ...]
    """(M, k) per recording: errors that neither the base's unknowns nor all candidates explain."""
    remaining_trials: int = 0
    """Sizes that are still to be tried."""

    diverged: tuple[str, ...] = ()
    """Titles of effects that could not be simulated at any size."""

    def without_columns(self) -> Screen:
        """The same without the signals of slopes and output changes."""
        return replace(self, slopes=(), output_changes=())


def _diverged(changes: Changes) -> tuple[str, ...]:
    simulated = {c.effect.kind for c in changes if not c.diverged}
    return tuple(dict.fromkeys(c.effect.title for c in changes if c.effect.kind not in simulated))


def on_threads(
    work: Callable[[Sequence[int]], list[OutputChange]], batches: Sequence[Sequence[int]]
) -> Generator[tuple[int, OutputChange]]:
    """The trials with their output changes, in order, computed on all cores; closing it cancels
    the rest."""
    with thread_pool(len(batches)) as pool:
        waiting = [pool.submit(work, batch) for batch in batches]
        try:
            for batch, task in zip(batches, waiting, strict=True):
                yield from zip(batch, task.result(), strict=True)
        finally:
            for task in waiting:
                task.cancel()


def screen(
    data: FitData, base: Problem, accepted: Sequence[Effect],
    candidates: Sequence[Effect], on_progress: Callable[[str], bool] = lambda _: False,
    on_interim: Callable[[Screen], None] | None = None,
) -> Screen:  # fmt: skip
    """Score every candidate. `on_progress(title)` is called after each; True stops. `on_interim`
    gets interim screens.

    Each candidate is tried at one size, then at all others, so that all can be compared early.
    Trials that need compilation wait for the second round.
    """
    errors = [np.asarray(b) for b in base.errors(base.vector)]
    slopes = [as_finite(s) for s in base.slopes(base.vector)]
    prior = base.limits.prior_measurements(base.vector)
    planned = [t for c in candidates for t in trials(base, c, data)]
    new = {i for i, t in enumerate(planned) if needs_compilation(t, base.model.arm)}
    rounds = trial_rounds(planned, new)
    base_errors, changes = BaseErrors(base), dict[int, OutputChange]()
    rows = whitened_rows(data.experiments)

    def scored() -> Screen:
        finished = [changes[i] for i in sorted(changes)]
        remaining = len(planned) - len(changes)
        return _score_candidates(errors, slopes, finished, candidates, remaining, rows, prior)

    def simulated(sized: Mapping[int, Trial], batch: Sequence[int]) -> list[OutputChange]:
        return simulate_output_changes(data, base, accepted, [sized[i] for i in batch], base_errors)

    for number, which in enumerate(rounds):
        if number and on_interim is not None:
            on_interim(scored())
        sized = {i: as_small_as(planned[i], changes.values()) for i in which}
        running = on_threads(partial(simulated, sized), batches_of(which, planned))
        for i, change in running:
            changes[i] = change
            if on_progress(_finished_title(i, planned, changes)):
                running.close()
                return scored()
    return scored()


def trial_rounds(planned: Sequence[Trial], late: Container[int] = ()) -> list[list[int]]:
    """Indices of the trials in two rounds: the middle of each grid, then all others, those in
    `late` last."""
    grids: dict[tuple[str, str], list[int]] = {}
    for i, trial in enumerate(planned):
        if i not in late:
            grids.setdefault((trial.effect.kind, trial.parameter), []).append(i)
    first = [grid[(len(grid) - 1) // 2] for grid in grids.values()]
    others = [i for grid in grids.values() for i in grid if i not in first]
    others += [i for i in range(len(planned)) if i in late]
    return [some for some in (first, others) if some]


def batches_of(which: Sequence[int], planned: Sequence[Trial]) -> list[list[int]]:
    """The trials of each effect, which fill the lanes side by side, up to BATCH at once."""
    by_effect: dict[str, list[int]] = {}
    for i in which:
        by_effect.setdefault(planned[i].effect.kind, []).append(i)
    return [
        some[at : at + BATCH] for some in by_effect.values() for at in range(0, len(some), BATCH)
    ]


def _finished_title(i: int, planned: Sequence[Trial], changes: Mapping[int, OutputChange]) -> str:
    """Title of a candidate of which trial i was the last one; else ''."""
    effect = planned[i].effect
    waits = any(t.effect is effect and k not in changes for k, t in enumerate(planned))
    return "" if waits else effect.title


def _score_candidates(
    errors: list[np.ndarray], slopes: list[np.ndarray], changes: list[OutputChange],
    candidates: Sequence[Effect], remaining_trials: int, rows: Sequence[Sequence[np.ndarray]],
    prior: tuple[np.ndarray, np.ndarray] | None = None,
) -> Screen:  # fmt: skip
    blocks = [c.blocks for c in changes]
    unwhitened = gram_matrix(errors, slopes, blocks, no_whitening, prior)
    remainders = remainders_of(unwhitened, errors, slopes, blocks)
    whitener = fit_whitener(remainders, rows)
    whitened = gram_matrix(errors, slopes, blocks, whitener, prior)
    w, u = whitened.projected(), unwhitened.projected()
    scores = [_score(c, changes, w, u) for c in candidates]
    kept = sorted((s for s in scores if s is not None), key=lambda s: -s.score)
    return Screen(
        tuple(kept), whitened, unwhitened, whitener, tuple(errors), tuple(slopes), tuple(changes),
        tuple(remainders), remaining_trials, _diverged(changes),
    )  # fmt: skip


def remainders_of(  # type: ignore[no-untyped-def]
    unwhitened: GramMatrix, errors, slopes, blocks
) -> list[np.ndarray]:
    """The residual with nuisance and all candidates projected out, (M, k) per recording."""
    C = unwhitened.total
    A, b = C[:-1, :-1], C[:-1, -1]
    d = np.where(np.diag(A) > NO_OUTPUT, np.sqrt(np.maximum(np.diag(A), NO_OUTPUT)), np.inf)
    x = np.linalg.lstsq(A / np.outer(d, d), b / d, rcond=1e-9)[0] / d
    remainders = []
    for i, r in enumerate(errors):
        own = np.stack([c[i] for c in blocks], axis=-1) if blocks else np.zeros((*r.shape, 0))
        remainders.append(r - np.concatenate([-slopes[i], own], axis=-1) @ x)
    return remainders


def _score(
    candidate: Effect, changes: Changes, w: np.ndarray, u: np.ndarray
) -> ScreenedCandidate | None:
    """`w`, `u`: projected Gram matrices, whitened and unwhitened."""
    if not any(c.effect is candidate for c in changes):
        return None
    best, unwhitened_best = (best_force_shape(candidate, changes, x) for x in (w, u))
    chosen, explained = best.chosen, best.explained
    score, parameters = explained.cost_reduction, len(chosen)
    fixed = [changes[i].one_sided for i in chosen]
    return ScreenedCandidate(
        effect=candidate, score=score, degrees_of_freedom=parameters, trial_count=best.trial_count,
        p_value=min(float(scipy.stats.chi2.sf(score, parameters)) * best.trial_count, 1.0),
        cost_reduction=(reduction := explained_by(u, chosen, fixed).cost_reduction),
        largest_reduction=max(reduction, unwhitened_best.explained.cost_reduction),
        values=_values(changes, chosen, explained.coefficients, w), output_changes=tuple(chosen),
        parameters=tuple(changes[i].parameter for i in chosen), scanned=_scanned(changes, chosen),
        prediction=_prediction(changes, chosen, explained.coefficients),
    )  # fmt: skip


def _scanned(changes: Changes, chosen: Sequence[int]) -> tuple[str, ...]:
    sizes = [changes[i].parameter for i in chosen if changes[i].scanned]
    shapes = {name: None for i in chosen for name in joint_force_shape(changes[i])}
    return (*sizes, *shapes)


FAR = 100.0
"""Times the tried size: a neutral value further away is no limit of a linear response."""


def _best_of_scan(changes: Changes, like: OutputChange, w: np.ndarray) -> dict[str, float]:
    """The grid size whose full response leaves the least error; empty if all of them leave more
    than there was."""
    if not like.scanned:
        return {}
    alike = [
        i
        for i, c in enumerate(changes)
        if (c.effect.kind, c.parameter, c.force_shape)
        == (like.effect.kind, like.parameter, like.force_shape)
    ]
    error_change, at = min((w[i, i] - 2.0 * w[i, -1], i) for i in alike)
    if error_change >= 0.0:
        return {}
    return {name: changes[at].values[name] for name in like.sizes}


def _values(
    changes: Changes, chosen: Sequence[int], coefficients: np.ndarray, w: np.ndarray
) -> dict[str, float]:
    """Start values of a refit: the best grid size as it is, else neutral + coefficient times the
    tried size.

    A grid size whose neutral value is far away (a limit that nothing reaches) stays as it is.
    """
    values: dict[str, float] = {}
    for i, coefficient in zip(chosen, coefficients, strict=True):
        c = changes[i]
        values |= joint_force_shape(c)
        for name, size in c.sizes.items():
            far = c.scanned and abs(size) > FAR * abs(c.values[name])
            share = 1.0 if far else float(coefficient)
            values[name] = (c.values[name] - size) + share * size  # just neutral without a share
        values |= _best_of_scan(changes, c, w)
    return values


def _prediction(
    changes: Changes, chosen: Sequence[int], coefficients: np.ndarray
) -> tuple[np.ndarray, ...]:
    total = [np.zeros_like(b) for b in changes[chosen[0]].blocks]
    for i, coefficient in zip(chosen, coefficients, strict=True):
        for t, b in zip(total, changes[i].blocks, strict=True):
            t += coefficient * b
    return tuple(total)
