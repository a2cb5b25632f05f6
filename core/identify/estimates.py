"""What a fit says: parameters with deviations, correlations, and what the data can tell."""

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
from ..identify.uncertainty import covariance
from ..identify.unknowns import Unknowns
from ..model import Model
from ..results import Estimate, Fit, Generation

COST_FLOOR = 1e-12
"""Of the outputs' sum of squares: a cost that no measurement shows. A valley's direction is
good to 1e-8, so that without noise its cost would rise, from nothing to next to nothing."""


@dataclass(frozen=True)
class SearchResult:
    """Where a search, or a search and the refinement after it, ended."""

    residuals: Residuals
    refined: RefinedFit
    history: tuple[Generation, ...]
    agreement: str
    stopped: bool


def summarise_fit(label: str, found: SearchResult) -> Fit:
    """The fit that a search found, with all that follows from where it ended."""
    residuals, refined = found.residuals, found.refined
    unknowns, vector = residuals.unknowns, refined.vector
    recordings = tuple(e.recording.name for e in residuals.experiments)
    P = len(unknowns)
    blocks = residuals.blocks(vector)
    sensitivities = list(refined.slopes) or residuals.sensitivities(vector)
    jacobian = residuals.vector(sensitivities) if P else np.zeros((1, 0))
    rank, _, null = (
        identifiability.analyse(unknowns, vector, jacobian) if P else (0, None, np.zeros((0, 0)))
    )
    cov = covariance(sensitivities, blocks, rank) if P else np.zeros((0, 0))
    seen = identifiability.identified(null, P) if P else np.zeros(0, dtype=bool)
    known = identifiability.determined(unknowns, vector, cov, null) if P else seen
    fast, floor = residuals.population(vector), COST_FLOOR * residuals.magnitude

    def cost(v: np.ndarray) -> float:
        found = residuals.costs(v[None]) if fast is None else fast(v[None])
        return floor + float(found[0])

    return Fit(
        label=label,
        recordings=recordings,
        estimates=_estimates(unknowns, vector, cov, seen, known),
        correlation=identifiability.correlation_of(cov),
        cost=refined.cost if np.isfinite(refined.cost) else _sum_of_squares(blocks),
        residual_count=residuals.count,
        convergence=found.history,
        identifiability=identifiability.identifiability_of(unknowns, vector, jacobian, cov, cost),
        gradient_norm=refined.gradient,
        message=found.agreement,
        stopped=found.stopped,
        converged=refined.converged and not found.stopped,
        derived=derived_estimates(residuals.experiments[0].model, unknowns, vector, cov, null),
    )


def _sum_of_squares(blocks: Sequence[np.ndarray]) -> float:
    return sum(float(np.sum(b * b)) for b in blocks)


def _estimates(
    unknowns: Unknowns, vector: np.ndarray, cov: np.ndarray, seen: np.ndarray, known: np.ndarray
) -> tuple[Estimate, ...]:
    """`seen`: has no part in what nothing shows; `known`: is determined by itself."""
    found = []
    for i, item in enumerate(unknowns.items):
        p = item.parameter
        value = float(vector[i])
        found.append(
            Estimate(
                name=p.name,
                value=value,
                std=float(np.sqrt(max(cov[i, i], 0.0))) if seen[i] else float("nan"),
                unit=p.unit,
                identifiable=bool(known[i]),
                symbol=p.symbol,
                start=p.value,
                lower=p.lower,
                upper=p.upper,
                recording=item.recording,
                at_bound=p.at_bound(value),
            )
        )
    return tuple(found)


def first_estimate_text(unknowns: Unknowns, vector: np.ndarray) -> str:
    """Where the first descent ended, in words."""
    pairs = zip(unknowns.items, vector, strict=True)
    shown = [
        f"{item.label} = {value:.4g} {item.parameter.unit}".strip()
        for item, value in pairs
        if item.searched
    ]
    more = f" and {len(shown) - MOST_SHOWN} more" if len(shown) > MOST_SHOWN else ""
    return f"first estimate: {', '.join(shown[:MOST_SHOWN])}{more}"


MOST_SHOWN = 4
"""Parameters of a first estimate that find room in a line."""


SECTION_NAMES = ("epsilon", "d")
STEP = 1e-6
"""Relative, of differences for what follows from the estimates."""


def derived_estimates(
    model: Model,
    unknowns: Unknowns,
    vector: np.ndarray,
    cov: np.ndarray,
    null: np.ndarray | None,
) -> tuple[Estimate, ...]:
    """EI of each bending segment whose modulus or width was estimated, by the delta method.

    A product may be fixed by the data where its factors are not: it is identifiable when no
    null direction changes it.
    """
    names = {item.parameter.name for item in unknowns.items if item.recording is None}
    if not any(name.rstrip("0123456789") in SECTION_NAMES for name in names):
        return ()
    values = {
        i.parameter.name: float(v)
        for i, v in zip(unknowns.items, vector, strict=True)
        if i.recording is None
    }
    base = _stiffness(model, values)
    slopes = np.zeros((len(base), len(vector)))
    for i, item in enumerate(unknowns.items):
        if item.recording is None:
            step = STEP * item.parameter.scale
            moved = {**values, item.parameter.name: float(vector[i]) + step}
            slopes[:, i] = (_stiffness(model, moved) - base) / step
    scales = relative_scales(unknowns, vector)
    found = []
    for k, value in enumerate(base):
        if not np.any(slopes[k]):
            continue
        change = slopes[k] * scales / value
        blind = null is not None and len(null) and np.abs(null @ change).max() >= INVOLVED
        std = float(np.sqrt(max(slopes[k] @ cov @ slopes[k], 0.0)))
        name = f"EI{k + 1}"
        found.append(
            Estimate(
                name, float(value), float("nan") if blind else std, "N m²", not blind,
                symbol(name), start=float(model.numbers().p[slot(k, STIFFNESS)]),
            )
        )  # fmt: skip
    return _merged(found, model, names)


def _stiffness(model: Model, values: Mapping[str, float]) -> np.ndarray:
    p = model.numbers(values).p
    return np.array([p[slot(k, STIFFNESS)] for k in range(model.arm.joints)])


def _merged(found: list[Estimate], model: Model, names: set[str]) -> tuple[Estimate, ...]:
    """One row 'EI' where all segments share the modulus and the width."""
    shared = names <= set(model.parameters) and not any(n[-1:].isdigit() for n in names)
    if shared and len({round(e.value, 9) for e in found}) == 1:
        e = found[0]
        return (
            Estimate("EI", e.value, e.std, e.unit, e.identifiable, symbol("EI"), start=e.start),
        )
    return tuple(found)
