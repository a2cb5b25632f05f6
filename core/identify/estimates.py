"""Results of a fit: parameters with standard deviations, correlations, identifiability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..arm.catalogue import symbol
from ..arm.slots import STIFFNESS, slot
from ..identify import identifiability
from ..identify.identifiability import INVOLVED, relative_scales
from ..identify.refinement import RefinedFit
from ..identify.residuals import Residuals
from ..identify.uncertainty import covariance, not_finite
from ..identify.unknowns import Unknowns
from ..least_squares import (
    BoundsAndPrior,
    bounds_and_prior,
    cost_of,
    normal_equations,
    pseudo_inverse,
    triangular,
)
from ..model import Model
from ..results import Estimate, Fit, Generation

COST_FLOOR = 1e-12
"""Share of the outputs' sum of squares: a cost that no measurement shows. A null direction is good
to 1e-8, so the cost along it would rise a little without noise."""


@dataclass(frozen=True)
class SearchResult:
    """End of a search, or of a search and its refinement."""

    residuals: Residuals
    refined: RefinedFit
    history: tuple[Generation, ...]
    agreement: str
    stopped: bool


def summarise_fit(label: str, result: SearchResult) -> Fit:
    """The fit at the end of a search, with all that follows from it."""
    residuals, refined = result.residuals, result.refined
    unknowns, vector = residuals.unknowns, refined.vector
    recordings = tuple(e.recording.name for e in residuals.experiments)
    P = len(unknowns)
    blocks = residuals.blocks(vector)
    squares = cost_of(blocks)
    if not np.isfinite(squares):
        raise not_finite("errors of the model")
    slopes = list(refined.slopes) or residuals.slopes(vector)
    jacobian = triangular(slopes) if P else np.zeros((1, 0))
    rank, _, null = (
        identifiability.analyse(unknowns, vector, jacobian) if P else (0, None, np.zeros((0, 0)))
    )
    limits = bounds_and_prior(unknowns.parameters)
    level = float(np.sqrt(squares / max(residuals.count, 1))) or 1.0
    cov = np.zeros((0, 0))
    if P:
        cov = covariance(
            slopes, blocks, residuals.counted, rank, known=limits.deviations, level=level
        )
    identified = identifiability.identified(null, P) if P else np.zeros(0, dtype=bool)
    determined = identifiability.determined(unknowns, vector, cov, null) if P else identified
    fast, floor = residuals.population(vector), COST_FLOOR * residuals.magnitude

    def cost(v: np.ndarray) -> float:
        result = residuals.costs(v[None]) if fast is None else fast(v[None])
        return floor + float(result[0])

    return Fit(
        label=label, recordings=recordings,
        estimates=_estimates(unknowns, vector, cov, identified, determined),
        contradicted=_contradicted(residuals, vector, slopes, blocks, limits),
        correlation=identifiability.correlation_of(cov),
        cost=refined.cost if np.isfinite(refined.cost) else squares,
        residual_count=residuals.count, convergence=result.history,
        identifiability=identifiability.identifiability_of(unknowns, vector, jacobian, cov, cost),
        gradient_norm=refined.gradient, message=result.agreement, stopped=result.stopped,
        converged=refined.converged and not result.stopped,
        derived=derived_estimates(residuals.experiments[0].model, unknowns, vector, cov, null),
    )  # fmt: skip


def _estimates(
    unknowns: Unknowns, vector: np.ndarray, cov: np.ndarray, identified: np.ndarray,
    determined: np.ndarray,
) -> tuple[Estimate, ...]:  # fmt: skip
    """`identified`: no part in a null direction; `determined`: determined by itself."""
    rows = []
    for i, item in enumerate(unknowns.items):
        p = item.parameter
        value = float(vector[i])
        rows.append(
            Estimate(
                name=p.name,
                value=value,
                std=float(np.sqrt(max(cov[i, i], 0.0))) if identified[i] else float("nan"),
                unit=p.unit,
                identifiable=bool(determined[i]),
                symbol=p.symbol,
                start=p.value,
                lower=p.lower,
                upper=p.upper,
                recording=item.recording,
                at_bound=p.at_bound(value),
            )
        )
    return tuple(rows)


SURELY_APART = 3.0
"""Deviations by which a prior and the recordings must differ to contradict each other."""


def _contradicted(
    residuals: Residuals, vector: np.ndarray, slopes: Sequence[np.ndarray],
    blocks: Sequence[np.ndarray], limits: BoundsAndPrior,
) -> dict[str, float]:  # fmt: skip
    """Label -> deviations between a parameter's prior and what the recordings alone would say, by
    one step from the minimum; only of those that are surely apart."""
    known = np.flatnonzero(np.isfinite(limits.deviations))
    if not len(known):
        return {}
    A, b = normal_equations(blocks, slopes)
    alone = vector - pseudo_inverse(A) @ b
    own = covariance(slopes, blocks, residuals.counted, len(vector))
    spread = np.diag(own) + limits.deviations**2
    apart = np.abs(alone - limits.prior_means) / np.sqrt(spread)
    labels = residuals.unknowns.labels
    return {labels[i]: float(apart[i]) for i in known if apart[i] > SURELY_APART}


def first_estimate_text(unknowns: Unknowns, vector: np.ndarray) -> str:
    """The end of the first descent, a `vector` (P,), as text."""
    pairs = zip(unknowns.items, vector, strict=True)
    shown = [
        f"{item.label} = {value:.4g} {item.parameter.unit}".strip()
        for item, value in pairs
        if item.searched
    ]
    more = f" and {len(shown) - MOST_SHOWN} more" if len(shown) > MOST_SHOWN else ""
    return f"first estimate: {', '.join(shown[:MOST_SHOWN])}{more}"


MOST_SHOWN = 4
"""Parameters of a first estimate that one line shows."""


SECTION_NAMES = ("epsilon", "d")
DERIVED_STEP = 1e-6
"""Relative step of differences for derived quantities."""


def derived_estimates(
    model: Model, unknowns: Unknowns, vector: np.ndarray, cov: np.ndarray, null: np.ndarray | None
) -> tuple[Estimate, ...]:
    """EI of each bending segment whose modulus or width was estimated, by the delta method, from a
    `vector` (P,) with `cov` (P, P). A product can be identifiable although its factors are not: if
    no null direction, `null` (d, P), changes it."""
    names = {item.parameter.name for item in unknowns.items if item.recording is None}
    if not any(name.rstrip("0123456789") in SECTION_NAMES for name in names):
        return ()
    values = unknowns.values_for(None, vector)
    base = _stiffness(model, values)
    slopes = np.zeros((len(base), len(vector)))
    for i, item in enumerate(unknowns.items):
        if item.recording is None:
            step = DERIVED_STEP * item.parameter.scale
            moved = {**values, item.parameter.name: float(vector[i]) + step}
            slopes[:, i] = (_stiffness(model, moved) - base) / step
    scales = relative_scales(unknowns, vector)
    rows = []
    for k, value in enumerate(base):
        if not np.any(slopes[k]):
            continue
        change = slopes[k] * scales / value
        blind = null is not None and len(null) and np.abs(null @ change).max() >= INVOLVED
        std = float(np.sqrt(max(slopes[k] @ cov @ slopes[k], 0.0)))
        name = f"EI{k + 1}"
        rows.append(
            Estimate(
                name, float(value), float("nan") if blind else std, "N m²", not blind,
                symbol(name), start=float(model.numbers().p[slot(k, STIFFNESS)]),
            )
        )  # fmt: skip
    return _merged(rows, model, names)


def _stiffness(model: Model, values: Mapping[str, float]) -> np.ndarray:
    p = model.numbers(values).p
    return np.array([p[slot(k, STIFFNESS)] for k in range(model.arm.joints)])


def _merged(rows: list[Estimate], model: Model, names: set[str]) -> tuple[Estimate, ...]:
    """One row 'EI' where all segments share the modulus and the width."""
    shared = names <= set(model.parameters) and not any(n[-1:].isdigit() for n in names)
    if shared and len({round(e.value, 9) for e in rows}) == 1:
        e = rows[0]
        return (
            Estimate("EI", e.value, e.std, e.unit, e.identifiable, symbol("EI"), start=e.start),
        )
    return tuple(rows)
