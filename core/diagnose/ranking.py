"""From a round's internals to the records that page, report and file show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..diagnose.acceptance import Round
from ..diagnose.evidence import RELEVANT, TIE, Weighed, acceptable
from ..diagnose.fit_problem import Data, names_of
from ..diagnose.ladder_steps import estimates
from ..diagnose.linear_screen import Screen, Screened
from ..diagnose.refit import Refit
from ..identify.identifiability import TOGETHER, correlation_of
from ..least_squares import normal_equations, pseudo_inverse
from ..results import Estimate, RankedEffect

PARALLEL = 0.95
"""|cos| of the smallest principal angle between projected directions from which on two effects
are said to be confusable."""

MOST_MEMBERS = 3
"""Effects of one group that a reader is shown."""


def confused_with(
    best: Weighed, found: Sequence[Weighed], seen: Screen, included: Sequence[str] = ()
) -> tuple[str, ...]:
    """Ids of the effects that the data cannot tell from `best`.

    What an effect includes does not compete with it: the simpler one is preferred as such.
    """
    competitors = []
    for other in found:
        kind = other.screened.effect.kind
        if other is best or kind in included:
            continue
        alike = parallel(seen, best.screened, other.screened) > PARALLEL
        apart = abs(best.delta_bic - other.delta_bic)
        if alike and apart < TIE:
            competitors.append((apart, kind))
    return tuple(kind for _, kind in sorted(competitors)[: MOST_MEMBERS - 1])


def parallel(seen: Screen, a: Screened, b: Screened) -> float:
    """Cosine of the smallest principal angle between two candidates' whitened directions."""
    W = seen.white.projected()
    A, B = list(a.columns), list(b.columns)
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


def ranking_of(found: Round, data: Data) -> tuple[RankedEffect, ...]:
    """Refitted candidates first, best first; then the others by expected reduction."""
    above = max(found.before.cost - data.count, RELEVANT * data.count)
    refitted = [_weighed(w, found, data, above) for w in found.weighed]
    have = {r.effect for r in refitted}
    rest = [s for s in found.screen.candidates if s.effect.kind not in have]
    rest.sort(key=lambda s: -s.drop)
    return (*refitted, *[_screened(s, above) for s in rest])


def _percent(drop: float, above: float) -> float:
    return 100.0 * min(max(drop / max(above, drop, 1e-300), 0.0), 1.0)


def _screened(s: Screened, above: float) -> RankedEffect:
    return RankedEffect(
        effect=s.effect.kind,
        title=s.effect.title,
        score=s.score,
        p_value=s.p_value,
        expected_drop_percent=_percent(s.drop, above),
        refit_drop_percent=None,
        delta_bic=None,
        predicted=s.prediction,
    )


def _weighed(w: Weighed, found: Round, data: Data, above: float) -> RankedEffect:
    s = w.screened
    model = w.refit.hypothesis.model
    names = names_of(s.effect, model, data.sizes)
    predicted = tuple(a - b for a, b in zip(found.before.errors, w.refit.errors, strict=True))
    return RankedEffect(
        effect=s.effect.kind,
        title=s.effect.title,
        score=s.score,
        p_value=w.p_value,
        expected_drop_percent=_percent(s.drop, above),
        refit_drop_percent=100.0 * w.reduction,
        delta_bic=w.delta_bic,
        tied_to=() if acceptable(w) else _tied_to(w.refit, names, found.before),
        confused_with=confused_with(w, found.weighed, found.screen, s.effect.includes),
        parameters=tuple(e for e in estimates(w.refit) if e.name in names),
        predicted=predicted,
    )


def _tied_to(refit: Refit, sizes: Sequence[str], before: Refit) -> tuple[Estimate, ...]:
    """The parameters of the model before that a size of the effect is correlated with beyond
    telling: along both the error is flat, and they stand anywhere."""
    labels, was = refit.hypothesis.unknowns.labels, before.hypothesis.values()
    own = [labels.index(name) for name in sizes if name in labels]
    A, _ = normal_equations(refit.descended.blocks, refit.descended.slopes)
    rho = np.abs(correlation_of(pseudo_inverse(A)))[own]
    tied = {label for k, label in enumerate(labels) if (rho[:, k] > TOGETHER).any()} & set(was)
    return tuple(replace(e, start=was[e.name]) for e in estimates(refit) if e.name in tied)
