"""A user's own formula, read by a whitelist over its syntax tree; nothing is ever evaluated.

Three gates, each cheap and each before the next: the text must consist of known tokens within
bounds (length, nesting); `ast.parse` only builds the tree; and every node must have a reader in
a table. What comes out is real by construction: real functions of real numbers (`RealFunction`),
so that neither reading nor a later derivative or renaming can take long. SymPy's own functions
ask whether their arguments are real by expanding complex parts, and sinh or tanh of sums with
twenty calls then takes minutes.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from itertools import accumulate
from keyword import iskeyword
from typing import Any

import sympy as sp

from ..effects.formula_functions import FORMULA_FUNCTIONS
from ..errors import InputError
from ..sentences import did_you_mean, one_line, quoted

WHERE = "[[model.own]] formula"
LONGEST_TEXT = 500
"""Characters; a page's input line, and short enough for any parser."""
DEEPEST = 20
"""Parentheses within parentheses."""
MOST_NODES = 200
"""Numbers, names, operations and calls; the readers recurse once for each at most."""
NESTED_CALLS = 6
NESTED_POWERS = 3
"""A power of a power of a power: x**512 at the most."""
HIGHEST_POWER = 8
LARGEST, SMALLEST = 1e30, 1e-30
"""Bounds of a number; the highest power of one is still a finite double."""
LONGEST_NAME = 20
LONGEST_LIST = 200
"""Characters of known names that a message repeats."""

_TOKEN = re.compile(
    r" +|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r"|(?P<number>(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?(?![A-Za-z0-9_.]))"
    r"|\*\*|[-+*/(),]",
    re.ASCII,
)
_ADVICE = {
    "^": "write ** for a power",
    "=": "write only what stands right of the equals sign",
    ".": "write names without a dot, and numbers like 0.5",
    "[": "use round parentheses",
}
_USE = "use plain letters, digits, + - * / ** and round parentheses"


def parse_formula(text: str, names: Mapping[str, sp.Symbol], where: str = WHERE) -> sp.Expr:
    """The formula as an expression in the symbols of `names` (states and parameters).

    Constants are floats. Anything but numbers, those names, + - * / **, unary minus and calls of
    FORMULA_FUNCTIONS is an InputError that starts with `where`.
    """
    read = _Reading(text.strip(), names, where)
    return read.expression(_tree(read))


@dataclass(frozen=True)
class _Reading:
    """A stripped text on its way to an expression, and what stands around the node being read."""

    text: str
    names: Mapping[str, sp.Symbol]
    where: str
    calls: int = 0
    powers: int = 0

    def error(self, fault: str) -> InputError:
        return InputError(one_line(f"{self.where}: {fault}."))

    def piece(self, node: ast.expr) -> str:
        """The node as the user wrote it; offsets count bytes, but the text is ASCII by now."""
        return quoted(self.text[node.col_offset : node.end_col_offset])

    def expression(self, node: ast.expr) -> sp.Expr:
        """Read one node, and check that its value is finite and within bounds."""
        read = _READERS.get(type(node))
        if read is None:
            raise self.error(f"{self.piece(node)} is not allowed in a formula; {_USE}")
        result = read(self, node)
        if not all(map(_sound, result.atoms(sp.Number, type(sp.zoo)))):
            raise self.error(
                f"{self.piece(node)} divides by zero or is not a real number between {SMALLEST:g} "
                f"and {LARGEST:g} in size; change its numbers"
            )
        return result


def _sound(number: sp.Expr) -> bool:
    return bool(number.is_zero) or bool(number.is_finite and SMALLEST <= abs(number) <= LARGEST)


def _tree(read: _Reading) -> ast.expr:
    """The syntax tree of a text that passed the checks which come before any parser."""
    text = read.text
    if not text:
        raise read.error("the formula is empty; write for instance -k*theta1")
    if len(text) > LONGEST_TEXT:
        raise read.error(f"the formula has {len(text)} characters; use at most {LONGEST_TEXT}")
    _check_tokens(read)
    _check_parentheses(read)
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        place = quoted(text[max((error.offset or 1) - 1, 0) :] or text[-1])
        raise read.error(
            f"it cannot be read at {place}; check that an operator stands between all terms"
        ) from None
    count = sum(isinstance(node, ast.expr) for node in ast.walk(tree))
    if count > MOST_NODES:
        raise read.error(f"the formula has {count} terms and operations; use at most {MOST_NODES}")
    return tree


def _check_tokens(read: _Reading) -> None:
    at = 0
    while at < len(read.text):
        token = _TOKEN.match(read.text, at)
        if token is None:
            raise read.error(_no_token(read.text[at:]))
        name = token["name"]
        if name and (name.startswith("_") or iskeyword(name)):
            raise read.error(f"the name {quoted(name)} cannot be used; choose another name")
        at = token.end()


def _no_token(text: str) -> str:
    if text[0].isascii() and text[0].isdigit():
        digits = re.match(r"[A-Za-z0-9_.]+", text, re.ASCII)
        return (
            f"{quoted(digits[0] if digits else text)} is not a number; write it like 12.5 or 1e-3"
        )
    return (
        f"the character {ascii(text[0])} is not allowed in a formula; {_ADVICE.get(text[0], _USE)}"
    )


def _check_parentheses(read: _Reading) -> None:
    steps = {"(": 1, ")": -1}
    depths = list(accumulate(steps.get(character, 0) for character in read.text))
    if min(depths) < 0 or depths[-1] != 0:
        raise read.error("the parentheses do not match; close each one that is opened")
    if max(depths) > DEEPEST:
        raise read.error(f"the parentheses are nested {max(depths)} deep; use at most {DEEPEST}")


def _number(read: _Reading, node: ast.Constant) -> sp.Expr:
    value: Any = node.value
    if type(value) not in (int, float):
        raise read.error(f"{read.piece(node)} is not a real number; write it like 12.5 or 1e-3")
    mantissa = re.split("[eE]", read.text[node.col_offset : node.end_col_offset])[0]
    zero = not re.search("[1-9]", mantissa)  # a tiny number also reads as 0.0
    if not zero and not SMALLEST <= abs(value) <= LARGEST:
        raise read.error(
            f"the number {read.piece(node)} is out of range; "
            f"use 0 or a size between {SMALLEST:g} and {LARGEST:g}"
        )
    return sp.Float(float(value))


def _name(read: _Reading, node: ast.Name) -> sp.Expr:
    if node.id in read.names:
        return read.names[node.id]
    if node.id in FORMULA_FUNCTIONS:
        raise read.error(f"{quoted(node.id)} is a function; write its argument in parentheses")
    raise read.error(f"the name {quoted(node.id)} is not known{_hint(node.id, read.names)}")


def _hint(name: str, names: Collection[str]) -> str:
    """The nearest known name and the list of all, as the end of a sentence."""
    guess = did_you_mean(name, names) if names else ""
    listed = ", ".join(names) or "numbers only"
    if len(listed) > LONGEST_LIST:
        listed = listed[:LONGEST_LIST].rpartition(",")[0] + " and others"
    return f" ({guess}); use {listed}" if guess.endswith("?") else f"; use {listed}"


def _call(read: _Reading, node: ast.Call) -> sp.Expr:
    word = node.func.id if isinstance(node.func, ast.Name) else ""
    if not word or word in read.names and word not in FORMULA_FUNCTIONS:
        raise read.error(f"{read.piece(node.func)} is not a function; write * for a product")
    if word not in FORMULA_FUNCTIONS:
        known = _hint(word, FORMULA_FUNCTIONS)
        raise read.error(f"the function {quoted(word)} is not known{known}")
    function = FORMULA_FUNCTIONS[word]
    if node.keywords or len(node.args) not in function.nargs:
        raise read.error(_wrong_arguments(function))
    if read.calls == NESTED_CALLS:
        raise read.error(f"functions are nested deeper than {NESTED_CALLS}; use fewer")
    inner = replace(read, calls=read.calls + 1)
    return function(*(inner.expression(argument) for argument in node.args))


def _wrong_arguments(function: type[sp.Function]) -> str:
    few, most = min(function.nargs), max(function.nargs)
    if few < most:
        return f"{function.word} takes {few} to {most} plain arguments: {function.usage}"
    return f"{function.word} takes {few} plain argument{'s'[: few - 1]}; write just that"


def _negative(read: _Reading, node: ast.UnaryOp) -> sp.Expr:
    if not isinstance(node.op, ast.USub):
        raise read.error(f"the sign of {read.piece(node)} is not allowed there; leave it out")
    return -read.expression(node.operand)


def _power(read: _Reading, node: ast.BinOp) -> sp.Expr:
    exponent = _exponent(read, node.right)
    if read.powers == NESTED_POWERS:
        raise read.error(f"powers are nested deeper than {NESTED_POWERS}; use fewer")
    base = replace(read, powers=read.powers + 1).expression(node.left)
    if exponent == int(exponent):
        return sp.Pow(base, int(exponent))
    return sp.Pow(FORMULA_FUNCTIONS["sqrt"](base), int(2 * exponent))


def _exponent(read: _Reading, node: ast.expr) -> float:
    """A literal number, perhaps with a minus sign: whole or half."""
    negative = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)
    literal = node.operand if isinstance(node, ast.UnaryOp) and negative else node
    if not isinstance(literal, ast.Constant):
        raise read.error(
            f"the exponent {read.piece(node)} is not a plain number; write a number, "
            f"or exp(b*log(a)) for a**b"
        )
    value = float(_number(read, literal))
    if value > HIGHEST_POWER or value * 2 != int(value * 2):
        raise read.error(
            f"the exponent {read.piece(node)} cannot be used; "
            f"take a whole or half number of at most {HIGHEST_POWER} in size"
        )
    return -value if negative else value


def _binary(read: _Reading, node: ast.BinOp) -> sp.Expr:
    operation = _OPERATIONS.get(type(node.op))
    if operation is None:
        raise read.error(f"{read.piece(node)} has an unknown operator; use + - * / **")
    return operation(read, node)


def _both(combine: Callable[[sp.Expr, sp.Expr], sp.Expr]) -> Callable[..., sp.Expr]:
    def operate(read: _Reading, node: ast.BinOp) -> sp.Expr:
        return combine(read.expression(node.left), read.expression(node.right))

    return operate


_OPERATIONS: dict[type[ast.operator], Callable[[_Reading, ast.BinOp], sp.Expr]] = {
    ast.Add: _both(lambda a, b: sp.Add(a, b)),
    ast.Sub: _both(lambda a, b: sp.Add(a, -b)),
    ast.Mult: _both(lambda a, b: sp.Mul(a, b)),
    ast.Div: _both(lambda a, b: sp.Mul(a, sp.Pow(b, -1))),
    ast.Pow: _power,
}

_READERS: dict[type[ast.expr], Callable[[_Reading, Any], sp.Expr]] = {
    ast.Constant: _number,
    ast.Name: _name,
    ast.Call: _call,
    ast.UnaryOp: _negative,
    ast.BinOp: _binary,
}
"""The whitelist: one reader per kind of node."""
