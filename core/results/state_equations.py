"""The whole model as statements: what a person, C and CasADi read alike."""

from __future__ import annotations

import re
from dataclasses import dataclass

_STATEMENT = re.compile(r"(\S+) (\+?=) (.+)")
_NAME = re.compile(r"[A-Za-z_]\w*(?:\[\d+\])?")


@dataclass(frozen=True)
class Quantity:
    """A state, a signal or a number, in SI units."""

    name: str
    unit: str
    """Empty: it has no dimension, or nobody stated it."""
    value: float = 0.0
    """Of a parameter; else where a simulation begins."""
    title: str = ""


def per_second(unit: str) -> str:
    """The unit of the rate of what has that unit; empty where that is not known."""
    head, _, below = unit.partition("/")
    if not unit:
        return ""
    return f"{head}/({below.strip('()')} s)" if below else f"{unit}/s"


@dataclass(frozen=True)
class StateEquations:
    """rates = x' and y as functions of states x, inputs r and parameters k.

    Each statement gives a name its value, `name = expression`, or adds to one. It uses x[i], r[i],
    k[i] and names of statements before; expressions are Python's, of numbers, + - * / **,
    comparisons, `a if c else b`, min, max, abs and functions of `math`.
    """

    states: tuple[Quantity, ...]
    """[q, q', states of the drive, states of the forces]"""
    coordinates: int
    """n, the length of q"""
    inputs: tuple[Quantity, ...]
    """Signals that forces depend on, then the drive's references."""
    outputs: tuple[Quantity, ...]
    parameters: tuple[Quantity, ...]
    """Those that may be changed: each statement uses k[i] wherever the number matters. Any other
    number is folded in."""
    statements: tuple[str, ...]

    def needed(self, target: str) -> tuple[str, ...]:
        """The statements on which all entries of `rates` or `y` depend, in their order."""
        wanted: set[str] = set()
        kept = []
        for statement in reversed(self.statements):
            left, sign, right = parts_of(statement)
            if left in wanted or left.startswith(f"{target}["):
                kept.append(statement)
                if sign == "=":
                    wanted.discard(left)
                wanted.update(_NAME.findall(right))
        return tuple(reversed(kept))


def parts_of(statement: str) -> tuple[str, str, str]:
    """Name, '=' or '+=', and expression."""
    match = _STATEMENT.fullmatch(statement)
    assert match is not None, statement
    return match[1], match[2], match[3]
