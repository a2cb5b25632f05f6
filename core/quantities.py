"""Numbers as settings may have them: finite, and of a size that arithmetic survives."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

LARGEST, SMALLEST = 1e15, 1e-15
"""SI. Young's modulus of diamond is 1.2e12 Pa and the inertia of a watch's hand 1e-12 kg m^2;
squares and products of a few numbers of these sizes are still far from overflow (1e308)."""


def _not_tiny(value: float) -> float:
    if 0.0 < value < SMALLEST:
        raise ValueError(f"is {value:g}; it must be at least {SMALLEST:g}.")
    return value


Bounded = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False), AfterValidator(_not_tiny)]
NonNegative = Annotated[
    float, Field(ge=0, le=LARGEST, allow_inf_nan=False), AfterValidator(_not_tiny)
]
