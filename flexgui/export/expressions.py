"""Expressions of the models' statements in other languages: one reader, a table per language."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flexgui.core.results.state_equations import parts_of

COMMON = (
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log",
    "sqrt",
)  # fmt: skip
"""Functions that Python, C and CasADi give the same name."""


@dataclass(frozen=True)
class Language:
    """What the parts of an expression become."""

    number: Callable[[float], Any]
    functions: Mapping[str, Callable[..., Any]]
    operators: Mapping[type, Callable[..., Any]]
    """Kind of node -> of its one or two operands; ast.IfExp: of condition and both values."""


def translated(text: str, language: Language, name: Callable[[str], Any]) -> Any:
    """The expression in another language; `name` gives what a name or an entry `x[3]` is there.

    Raises:
        ValueError: Where it holds anything that the language does not know.
    """

    def read(node: ast.expr) -> Any:
        match node:
            case ast.Constant(value=int() | float() as number) if type(number) is not bool:
                return language.number(float(number))
            case ast.Name(id=word):
                return name(word)
            case ast.Subscript(value=ast.Name(id=array), slice=ast.Constant(value=int() as i)):
                return name(f"{array}[{i}]")
            case ast.Call(func=ast.Name(id=word), args=arguments, keywords=[]) if (
                word in language.functions
            ):
                return language.functions[word](*map(read, arguments))
            case ast.UnaryOp(op=op, operand=operand):
                return language.operators[type(op)](read(operand))
            case (
                ast.BinOp(left=left, op=op, right=right)
                | ast.Compare(left=left, ops=[op], comparators=[right])
            ):
                return language.operators[type(op)](read(left), read(right))
            case ast.BoolOp(op=op, values=[first, *others]):
                total = read(first)
                for other in others:
                    total = language.operators[type(op)](total, read(other))
                return total
            case ast.IfExp(test=test, body=body, orelse=other):
                return language.operators[ast.IfExp](*map(read, (test, body, other)))
        raise ValueError(ast.unparse(node))

    try:
        return read(ast.parse(text, mode="eval").body)
    except (KeyError, ValueError) as error:
        raise ValueError(f"no translation of {text!r}: {error}") from None


def _joined(sign: str) -> Callable[[str, str], str]:
    return lambda a, b: f"({a} {sign} {b})"


def _called(word: str) -> Callable[..., str]:
    return lambda *arguments: f"{word}({', '.join(arguments)})"


def _power(base: str, exponent: str) -> str:
    """A product of a name with itself where that is short."""
    if re.fullmatch(r"[2-9]\.0", exponent) and re.fullmatch(r"[\w\[\]]+", base):
        return "(" + "*".join([base] * int(float(exponent))) + ")"
    return f"pow({base}, {exponent})"


C = Language(
    number=repr,
    functions={name: _called(name) for name in COMMON}
    | {"abs": _called("fabs"), "min": _called("fmin"), "max": _called("fmax")},
    operators={
        ast.Add: _joined("+"), ast.Sub: _joined("-"), ast.Mult: _joined("*"), ast.Div: _joined("/"),
        ast.Pow: _power, ast.USub: lambda a: f"(-{a})", ast.Not: lambda a: f"(!{a})",
        ast.Lt: _joined("<"), ast.LtE: _joined("<="), ast.Gt: _joined(">"), ast.GtE: _joined(">="),
        ast.Eq: _joined("=="), ast.NotEq: _joined("!="), ast.And: _joined("&&"),
        ast.Or: _joined("||"), ast.IfExp: lambda test, a, b: f"({test} ? {a} : {b})",
    },
)  # fmt: skip


def c_statements(statements: Iterable[str]) -> list[str]:
    """Lines of C99: names become constants, entries are written where they are."""
    lines = []
    for statement in statements:
        left, sign, right = parts_of(statement)
        kind = "" if "[" in left else "const double "
        lines.append(f"{kind}{left} {sign} {translated(right, C, str)};")
    return lines


def in_c(text: str, variables: Sequence[str]) -> str:
    """A function of the posture as a C expression; `variables[i]` is written theta[i].

    Raises:
        ValueError: Where it holds any other name, or what is no arithmetic.
    """
    return str(translated(text, C, lambda name: f"theta[{variables.index(name)}]"))
