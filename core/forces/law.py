"""A force law in symbols: what is displayed is what is compiled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import sympy as sp


@dataclass(frozen=True)
class ForceLaw:
    """k forces as functions of k displacements, their rates, m states and parameters.

    `forces[i]` acts along the direction in which `x[i]` is measured; the first m ports carry
    one state each with the rate `rates[i]`. SI throughout.
    """

    x: tuple[sp.Symbol, ...]
    v: tuple[sp.Symbol, ...]
    forces: tuple[sp.Expr, ...]
    parameters: tuple[sp.Symbol, ...]
    states: tuple[sp.Symbol, ...] = ()
    rates: tuple[sp.Expr, ...] = ()
    bristle: bool = False
    """Whether the law is dry friction: one port whose state is a share of the force in [-1, 1],
    its rate of first degree in the state, and nothing depends on the displacement."""

    def __post_init__(self) -> None:
        if self.bristle and (len(self.x), len(self.states)) != (1, 1):
            raise ValueError("a bristle has one port and one state")
        symbols = (*self.x, *self.v, *self.states, *self.parameters)
        if len(set(symbols)) < len(symbols):
            raise ValueError(f"one symbol stands for two things among {symbols}")

    interpreted: ClassVar[bool] = False
    """Whether it comes and goes, as a formula that a person tries."""

    @property
    def size(self) -> int:
        """How many outputs there are."""
        return 3 * len(self.x) + 4 * len(self.states)

    def outputs(self) -> tuple[sp.Expr, ...]:
        """[F, dF/dx, dF/dv, rate, dF/dw, drate/dv, drate/dw]; see core.simulate.elements."""
        carried = list(zip(self.states, self.rates, strict=True))
        return (
            *self.forces,
            *[sp.diff(f, x) for f, x in zip(self.forces, self.x, strict=True)],
            *[sp.diff(f, v) for f, v in zip(self.forces, self.v, strict=True)],
            *self.rates,
            *[sp.diff(self.forces[i], w) for i, (w, _) in enumerate(carried)],
            *[sp.diff(rate, self.v[i]) for i, (_, rate) in enumerate(carried)],
            *[sp.diff(rate, w) for w, rate in carried],
        )


def joint_law(
    force: sp.Expr,
    parameters: tuple[sp.Symbol, ...],
    rate: sp.Expr | None = None,
    bristle: bool = False,
) -> ForceLaw:
    """A law with one port, in the symbols `X`, `V` and, where it has a state, `W`."""
    states = () if rate is None else (W,)
    rates = () if rate is None else (rate,)
    return ForceLaw((X,), (V,), (force,), parameters, states, rates, bristle)


X = sp.Symbol("x", real=True)
V = sp.Symbol("v", real=True)
W = sp.Symbol("w", real=True)
