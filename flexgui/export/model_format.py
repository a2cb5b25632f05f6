"""The contract of a model format: its limits in words, its matrices over the posture."""

from __future__ import annotations

import ast
import re
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence

from flexgui import __version__
from flexgui.core.results import Outcome, PresentEffect
from flexgui.sentences.written import format_number

WIDTH = 92
"""Characters in a line of a header."""

LINEAR_LIMITS = (
    "Linear model of small motion about a posture, with the drive's loop closed. The posture is "
    "scheduled.",
    "Not in this file: sensor noise, limits of the drives, and the camera outputs z1 and z2 (not "
    "linear in the joint angles).",
)
"""Of every format that holds the matrices."""


class ModelFormat(ABC):
    """One format; exports write its files, the page offers them as a download."""

    kind: str = ""
    """Id of the plug-in; the page lists formats in the order of their ids."""
    label: str = ""
    """On the page's button."""
    hint: str = ""

    def unable(self, outcome: Outcome) -> str:
        """Why this outcome cannot be written in this format; empty if it can."""
        return ""

    @abstractmethod
    def files(self, outcome: Outcome) -> dict[str, bytes]:
        """Path inside the export -> content."""


def linear_header(outcome: Outcome, what: str) -> list[str]:
    """Lines about a file with the linear model: what it is, what it carries, what it cannot."""
    effects = _effects(outcome)
    carried = [e for e in effects if e.linear and e.acts_on != "sensor"]
    return header(outcome, what, carried, LINEAR_LIMITS)


def header(
    outcome: Outcome, what: str, carried: Iterable[PresentEffect], limits: Iterable[str]
) -> list[str]:
    """Lines of at most WIDTH characters.

    Args:
        outcome: Whose model it is.
        what: A phrase for the file, such as "C code of the linear model".
        carried: Those of the outcome's effects that are in the file.
        limits: Sentences on what the format cannot carry in general.
    """
    inside = tuple(carried)
    outside = [e for e in _effects(outcome) if e not in inside]
    texts = [f"{plain(outcome.title)}: {what}, written by FlexGUI {__version__}. SI units."]
    if inside:
        texts.append(f"Found and in this file: {_listed(inside)}.")
    if outside:
        texts.append(
            f"Found, but NOT in this file, because its format cannot hold it: {_listed(outside)}."
        )
    texts += limits
    return [line for text in texts for line in textwrap.wrap(text, WIDTH)]


def _effects(outcome: Outcome) -> tuple[PresentEffect, ...]:
    return () if outcome.mechanism is None else outcome.mechanism.effects


def _listed(effects: Iterable[PresentEffect]) -> str:
    return "; ".join(_effect(e) for e in effects)


def _effect(effect: PresentEffect) -> str:
    sizes = [f"{name} = {format_number(x)} {unit}".strip() for name, x, unit in effect.sizes]
    return plain(f"{effect.title} ({', '.join(sizes)})" if sizes else effect.title)


def plain(text: str) -> str:
    """One line without sequences that end a comment in C, XML or Python."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return re.sub(r"-{2,}", "-", line).replace("*/", "* /").replace("/*", "/ *").replace("\\", "/")


FUNCTIONS = frozenset({"cos", "sin"})

_OPERATORS: dict[type, str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}


def scheduled(bases: Sequence[str]) -> tuple[str, ...]:
    """Names of the joint positions that the matrices depend on, such as theta2."""
    indices = {
        node.id
        for text in bases
        for node in ast.walk(ast.parse(text, mode="eval"))
        if isinstance(node, ast.Name) and node.id not in FUNCTIONS
    }
    return tuple(sorted(indices))


def in_c(text: str, variables: Sequence[str]) -> str:
    """A basis function as a C expression; `variables[i]` is written theta[i].

    Raises:
        ValueError: Where it holds anything but numbers, joint positions, cos, sin and + - * / **
            with a whole exponent.
    """
    return _c(ast.parse(text, mode="eval").body, variables)


def _c(node: ast.expr, variables: Sequence[str]) -> str:
    match node:
        case ast.Constant(value=int() | float() as number):
            return repr(float(number))
        case ast.Name(id=name) if name in variables:
            return f"theta[{variables.index(name)}]"
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return f"(-{_c(inner, variables)})"
        case ast.Call(func=ast.Name(id=name), args=[inner]) if name in FUNCTIONS:
            return f"{name}({_c(inner, variables)})"
        case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=int() as power)):
            return "(" + "*".join([_c(left, variables)] * max(power, 1)) + ")"
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            sign = _OPERATORS[type(op)]
            return f"({_c(left, variables)} {sign} {_c(right, variables)})"
    raise ValueError(f"no C for {ast.unparse(node)!r}")
