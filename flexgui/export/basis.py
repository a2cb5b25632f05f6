"""The functions of the posture that the model's matrices are affine in, as program text."""

from __future__ import annotations

import ast
from collections.abc import Sequence

FUNCTIONS = frozenset({"cos", "sin"})

_OPERATORS: dict[type, str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}


def scheduled(bases: Sequence[str]) -> tuple[str, ...]:
    """Names of the joint positions that occur, such as theta2, in their order."""
    found = {
        node.id
        for text in bases
        for node in ast.walk(ast.parse(text, mode="eval"))
        if isinstance(node, ast.Name) and node.id not in FUNCTIONS
    }
    return tuple(sorted(found))


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
