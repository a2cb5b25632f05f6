"""The symbols in which an arm is stated, and its structure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from core.arm.arm import Arm
from core.arm.slots import PER_SEGMENT

_LATEX_SLOTS = ("l", "m", "(EI)", r"\tau", r"m_{t}", r"J_{t}", r"J_{h}", r"\alpha")
_NAMES = ("l", "m", "EI", "tau", "mt", "Jt", "Jh", "axis")


@dataclass(frozen=True)
class Structure:
    """What is compiled in: kinds of joint, number of modes, mounts."""

    joints: tuple[str, ...]
    modes: tuple[int, ...]
    mounts: tuple[str, ...]

    @classmethod
    def of(cls, arm: Arm) -> Structure:
        return cls(
            tuple(s.joint for s in arm.segments), arm.modes, tuple(s.mount for s in arm.segments)
        )

    @property
    def segments(self) -> int:
        return len(self.joints)

    @property
    def coordinates(self) -> int:
        return self.segments + sum(self.modes)


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
        return tuple(sp.Symbol(f"theta{k + 1}", real=True) for k in range(self.structure.segments))

    @cached_property
    def modal(self) -> tuple[tuple[sp.Symbol, ...], ...]:
        return tuple(
            tuple(sp.Symbol(f"v{k + 1}_{i + 1}", real=True) for i in range(n))
            for k, n in enumerate(self.structure.modes)
        )

    @cached_property
    def q(self) -> tuple[sp.Symbol, ...]:
        return self.theta + tuple(v for segment in self.modal for v in segment)

    @cached_property
    def dq(self) -> tuple[sp.Symbol, ...]:
        return tuple(sp.Symbol(f"d{name}", real=True) for name in self.q)

    @cached_property
    def p(self) -> tuple[sp.Symbol, ...]:
        """In the order of core.arm.slots."""
        names = [f"{name}{k + 1}" for k in range(self.structure.segments) for name in _NAMES]
        return tuple(sp.Symbol(name, real=True) for name in [*names, "g1", "g2"])

    def slot(self, segment: int, which: int) -> sp.Symbol:
        return self.p[PER_SEGMENT * segment + which]

    @property
    def gravity(self) -> tuple[sp.Symbol, sp.Symbol]:
        return self.p[-2], self.p[-1]

    @cached_property
    def latex_names(self) -> dict[sp.Symbol, str]:
        """How each symbol is written; one-mode arms drop the mode's index, as the paper does."""
        names: dict[sp.Symbol, str] = {self.gravity[0]: "g_1", self.gravity[1]: "g_2"}
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
        return str(sp.latex(expression, symbol_names=self.latex_names))
