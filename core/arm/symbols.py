"""The symbols in which an arm is stated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from ..arm.arm import Structure
from ..arm.slots import PER_SEGMENT

_LATEX_SLOTS = (
    "l", "m", "(EI)", r"\tau", r"m_{t}", r"J_{t}", r"J_{h}", r"\alpha", "k_{j}", r"J_{r}",
    "x_{c}", "y_{c}", "J_{c}",
)  # fmt: skip
_NAMES = ("l", "m", "EI", "tau", "mt", "Jt", "Jh", "axis", "kj", "Jr", "xc", "yc", "Jc")


@dataclass(frozen=True)
class Symbols:
    """SymPy symbols of one structure; segments count from 0 here, from 1 in names."""

    structure: Structure

    @cached_property
    def x(self) -> sp.Symbol:
        """Place along a segment, m."""
        return sp.Symbol("x", positive=True)

    @cached_property
    def theta(self) -> tuple[sp.Symbol, ...]:
        """Joint positions, rad (m where a joint slides)."""
        return tuple(sp.Symbol(f"theta{k + 1}", real=True) for k in range(self.structure.segments))

    @cached_property
    def modal(self) -> tuple[tuple[sp.Symbol, ...], ...]:
        """Modal coordinates v of each segment."""
        return tuple(
            tuple(sp.Symbol(f"v{k + 1}_{i + 1}", real=True) for i in range(n))
            for k, n in enumerate(self.structure.modes)
        )

    @cached_property
    def twist(self) -> tuple[sp.Expr, ...]:
        """By how much each joint's segment is turned beyond its motor; 0 where it is rigid."""
        elastic = self.structure.elastic or (False,) * self.structure.segments
        return tuple(
            sp.Symbol(f"twist{k + 1}", real=True) if twists else sp.Integer(0)
            for k, twists in enumerate(elastic)
        )

    @cached_property
    def base(self) -> tuple[sp.Symbol, ...]:
        """The two displacements of the base, m; none where it is rigid."""
        names = ("base1", "base2") if self.structure.base else ()
        return tuple(sp.Symbol(name, real=True) for name in names)

    @cached_property
    def pedestal(self) -> sp.Expr:
        """The angle of the base, rad; 0 where it does not turn."""
        return sp.Symbol("pedestal", real=True) if self.structure.pedestal else sp.Integer(0)

    @cached_property
    def q(self) -> tuple[sp.Symbol, ...]:
        """All coordinates in their order."""
        modal = tuple(v for segment in self.modal for v in segment)
        twists = tuple(t for t in self.twist if t != 0)
        pedestal = (self.pedestal,) if self.pedestal != 0 else ()
        return self.theta + modal + twists + self.base + pedestal

    @property
    def straight(self) -> dict[sp.Symbol, int]:
        """All that is zero when the arm is straight and nothing is deflected."""
        return {q: 0 for q in self.q if q not in self.theta}

    @cached_property
    def dq(self) -> tuple[sp.Symbol, ...]:
        """Their velocities."""
        return tuple(sp.Symbol(f"d{name}", real=True) for name in self.q)

    @cached_property
    def p(self) -> tuple[sp.Symbol, ...]:
        """In the order of core.arm.slots."""
        names = [f"{name}{k + 1}" for k in range(self.structure.segments) for name in _NAMES]
        return tuple(sp.Symbol(name, real=True) for name in [*names, "g1", "g2", "kb", "kp", "Jp"])

    def slot(self, segment: int, which: int) -> sp.Symbol:
        """The symbol of a segment's number; `which` as in core.arm.slots."""
        return self.p[PER_SEGMENT * segment + which]

    @property
    def gravity(self) -> tuple[sp.Symbol, sp.Symbol]:
        """Gravity in the plane, m/s²."""
        return self.p[-5], self.p[-4]

    @property
    def base_stiffness(self) -> sp.Symbol:
        """Stiffness of the base, N/m."""
        return self.p[-3]

    @property
    def pedestal_stiffness(self) -> sp.Symbol:
        """Stiffness against turning, N m/rad."""
        return self.p[-2]

    @property
    def pedestal_inertia(self) -> sp.Symbol:
        """Inertia that turns with the base, kg m²."""
        return self.p[-1]

    @cached_property
    def latex_names(self) -> dict[sp.Symbol, str]:
        """How each symbol is written; one-mode arms drop the mode's index, as the paper does."""
        names: dict[sp.Symbol, str] = {
            self.gravity[0]: "g_1", self.gravity[1]: "g_2", self.base_stiffness: "k_b",
            self.pedestal_stiffness: "k_p", self.pedestal_inertia: "J_p",
        }  # fmt: skip
        names |= {b: rf"b_{i + 1}" for i, b in enumerate(self.base)}
        names |= {self.pedestal: r"\beta"} if self.pedestal != 0 else {}
        names |= {t: rf"\varphi_{{j{k + 1}}}" for k, t in enumerate(self.twist) if t != 0}
        for k in range(self.structure.segments):
            names[self.theta[k]] = rf"\theta_{{{k + 1}}}"
            for which, text in enumerate(_LATEX_SLOTS):
                base, _, index = text.partition("_")
                sub = index.strip("{}") + str(k + 1)
                names[self.slot(k, which)] = f"{base}_{{{sub}}}"
            for i, v in enumerate(self.modal[k]):
                only = self.structure.modes[k] == 1
                names[v] = rf"v_{{{k + 1}}}" if only else rf"v_{{{k + 1},{i + 1}}}"
        for q, dq in zip(self.q, self.dq, strict=True):
            names[dq] = rf"\dot{{{names[q]}}}"
        return names

    def latex(self, expression: sp.Basic) -> str:
        """An expression as a formula to read."""
        return str(sp.latex(expression, symbol_names=self.latex_names))
