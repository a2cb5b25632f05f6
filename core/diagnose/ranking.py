"""The ranking of a round, as the records that page, report and file show."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..diagnose.evidence import LEAST_SHARE, TIE, RefittedCandidate, Round, certain
from ..diagnose.linear_screen import Screen, ScreenedCandidate
from ..diagnose.stated_results import Noise, estimates
from ..estimate.fit_result import FitResult
from ..estimate.minimum import RELEVANT
from ..estimate.problem import FitData, parameter_names
from ..identify.identifiability import POORLY_DISTINGUISHABLE, correlation_of
from ..information_criteria import fall_of_bic
from ..least_squares import normal_equations, pseudo_inverse, with_prior
from ..results import Estimate, RankedEffect

CONFUSABLE = 0.95
"""|cos| of the smallest principal angle between two effects, above which they are confusable."""

MOST_MEMBERS = 3
"""Effects of one confusable group that are shown."""


def confused_with(
    best: RefittedCandidate, refitted: Sequence[RefittedCandidate], screened: Screen,
    included: Sequence[str] = (),
) -> tuple[str, ...]:  # fmt: skip
    """Ids of the effects that the data cannot distinguish from `best`.

    What an effect includes does not compete with it: the simpler one is preferred as such.
    """
    competitors = []
    for other in refitted:
        kind = other.screened.effect.kind
        if other is best or kind in included:
            continue
        alike = largest_cosine(screened, best.screened, other.screened) > CONFUSABLE
        difference = abs(best.gain - other.gain)
        if alike and difference < TIE:
            competitors.append((difference, kind))
    return tuple(kind for _, kind in sorted(competitors)[: MOST_MEMBERS - 1])


def largest_cosine(screened: Screen, a: ScreenedCandidate, b: ScreenedCandidate) -> float:
    """Cosine of the smallest principal angle between two candidates' whitened directions (Björck
    and Golub 1973)."""
    W = screened.whitened.projected()
    A, B = list(a.output_changes), list(b.output_changes)
    if not A or not B:
        return 0.0
    half_a, half_b = _inverse_root(W[np.ix_(A, A)]), _inverse_root(W[np.ix_(B, B)])
    between = half_a.T @ W[np.ix_(A, B)] @ half_b
    return float(min(np.linalg.svd(between, compute_uv=False)[0], 1.0)) if between.size else 0.0


def _inverse_root(A: np.ndarray) -> np.ndarray:
    """X with X' A X = I on the directions that are there."""
    d = np.sqrt(np.maximum(np.diag(A), 1e-300))
    values, vectors = np.linalg.eigh(A / np.outer(d, d))
    kept = values > 1e-9 * values.max()
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])) / d[:, None])


def ranking_of(
    result: Round, data: FitData, noise: Noise | None = None
) -> tuple[RankedEffect, ...]:
    """Refitted candidates first, best first; then the others by expected reduction. `noise`: that
    whitens for ΔBIC; None: what the screen leaves."""
    above = max(result.before.cost - data.count, RELEVANT * data.count)
    refitted = []
    if result.refitted:
        noise = noise or Noise.of(data, result.screen.remainders)
        before = noise.left(data, result.before)
        for w in result.refitted:
            left = noise.left(data, w.refit)
            fall = fall_of_bic(before, left, noise.products)
            record = _refitted_record(w, result, data, above)
            record = record if fall is None else replace(record, delta_bic=fall)
            refitted.append(replace(record, left=left))
    have = {r.effect for r in refitted}
    others = [s for s in result.screen.candidates if s.effect.kind not in have]
    others.sort(key=lambda s: -s.cost_reduction)
    return (*refitted, *[_screened_record(s, above) for s in others])


def _percent(reduction: float, above: float) -> float:
    return 100.0 * min(max(reduction / max(above, reduction, 1e-300), 0.0), 1.0)


def _screened_record(s: ScreenedCandidate, above: float) -> RankedEffect:
    return RankedEffect(
        effect=s.effect.kind, title=s.effect.title, score=s.score, p_value=s.p_value,
        expected_drop_percent=_percent(s.cost_reduction, above), refit_drop_percent=None,
        delta_bic=None, predicted=s.prediction,
    )  # fmt: skip


def _refitted_record(
    w: RefittedCandidate, result: Round, data: FitData, above: float
) -> RankedEffect:
    s = w.screened
    model = w.refit.problem.model
    names = parameter_names(s.effect, model, data.sizes)
    predicted = tuple(a - b for a, b in zip(result.before.errors, w.refit.errors, strict=True))
    found = certain(w) and w.reduction >= LEAST_SHARE
    return RankedEffect(
        effect=s.effect.kind, title=s.effect.title, score=s.score, p_value=w.p_value,
        expected_drop_percent=_percent(s.cost_reduction, above),
        refit_drop_percent=100.0 * w.reduction, delta_bic=w.gain,
        unseen_rms=math.sqrt(w.unseen),
        tied_to=() if found else _tied_to(w.refit, names, result.before),
        confused_with=confused_with(w, result.refitted, result.screen, s.effect.includes),
        parameters=tuple(e for e in estimates(w.refit) if e.name in names), predicted=predicted,
    )  # fmt: skip


def _tied_to(refit: FitResult, sizes: Sequence[str], before: FitResult) -> tuple[Estimate, ...]:
    """Parameters of the previous model whose correlation with a size of the effect is near one: the
    cost hardly depends on both, so their estimates are arbitrary."""
    labels, values_before = refit.problem.unknowns.labels, before.problem.values()
    own = [labels.index(name) for name in sizes if name in labels]
    problem, end = refit.problem, refit.descended
    A, _ = with_prior(*normal_equations(end.blocks, end.slopes), problem.vector, problem.limits)
    rho = np.abs(correlation_of(pseudo_inverse(A)))[own]
    tied = {
        label for k, label in enumerate(labels) if (rho[:, k] > POORLY_DISTINGUISHABLE).any()
    } & set(values_before)
    return tuple(
        replace(e, start=values_before[e.name]) for e in estimates(refit) if e.name in tied
    )
