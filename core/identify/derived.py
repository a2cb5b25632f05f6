"""Quantities that follow from the estimates, such as EI from the modulus and the width."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from core.arm.catalogue import symbol
from core.arm.slots import STIFFNESS, slot
from core.identify.identifiability import INVOLVED, relative_scales
from core.identify.unknowns import Unknowns
from core.model import Model
from core.results import Estimate

SECTION_NAMES = ("epsilon", "d")
STEP = 1e-6


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
