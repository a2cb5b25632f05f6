"""What own formulas have in common: their words, their parameters, and which of these are sizes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import combinations

import sympy as sp

from ..effects.effect import EffectParameter
from ..effects.formula import LONGEST_NAME, parse_formula
from ..effects.formula_functions import FORMULA_FUNCTIONS
from ..errors import InputError
from ..parameters import Parameter
from ..recording.inputs import INPUTS

MOST_PARAMETERS = 20
"""A table has one for each knot."""

RATE = "d"
"""Before a port's name: its rate."""

PORT = re.compile(r"(theta|delta|z)([1-9])")
"""Words of places that a formula sees."""

_NAME = re.compile(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST_NAME - 1}}}")
_TORQUE = re.compile(r"u[1-9]")
_LETTERS = {"theta": r"\theta", "delta": r"\delta", "z": "z"}


def check_names(names: Sequence[str], where: str) -> None:
    """InputError where a parameter's name cannot be used in a formula."""
    if len(names) > MOST_PARAMETERS:
        raise InputError(f"{where} has {len(names)} parameters; give {MOST_PARAMETERS} at most.")
    for name in names:
        if not _NAME.fullmatch(name):
            raise InputError(
                f"{where} parameters: {name!r} is not a valid name; use letters, digits and _, "
                f"with a letter first."
            )
        if name in FORMULA_FUNCTIONS:
            raise InputError(
                f"{where} parameters: {name!r} is the name of a function; choose another."
            )
        if port_of(name) or name in INPUTS or _TORQUE.fullmatch(name):
            raise InputError(
                f"{where} parameters: {name!r} is the name of a state or signal; choose another."
            )


def port_of(word: str) -> str:
    """The port whose place or rate a word is; '' where it is no state's name."""
    port = word if PORT.fullmatch(word) else word.removeprefix(RATE)
    return port if PORT.fullmatch(port) else ""


def read_formula(formula: str, states: Sequence[str], names: Sequence[str], where: str) -> sp.Expr:
    """The formula in real symbols; InputError where it is zero or a parameter does not occur."""
    symbols = {word: sp.Symbol(word, real=True) for word in (*states, *names)}
    expression = parse_formula(formula, symbols, f"{where} formula")
    if is_nothing(expression):
        raise InputError(f"{where} formula is always zero; leave the effect out.")
    idle = [name for name in names if symbols[name] not in expression.free_symbols]
    if idle:
        raise InputError(
            f"{where} parameters: {idle[0]!r} does not occur in the formula; leave it out."
        )
    return expression


def size_names(force: sp.Expr, own: Sequence[sp.Symbol], where: str) -> tuple[str, ...]:
    """Parameters that make the formula zero when they are, and of which none can be left out: the
    fewest, where one or two do. InputError where all of them do not."""
    for count in (1, 2):
        for chosen in combinations(own, count):
            if _vanishes(force, chosen):
                return tuple(symbol.name for symbol in chosen)
    if _vanishes(force, own):
        for symbol in reversed(own):
            fewer = tuple(s for s in own if s is not symbol)
            own = fewer if _vanishes(force, fewer) else own
        return tuple(symbol.name for symbol in own)
    if own:
        raise InputError(
            f"{where} does not become zero when its parameters do; multiply it by one of them, "
            f"which is then the size of the effect."
        )
    return ()


def effect_parameters(
    parameters: Sequence[Parameter], sizes: Sequence[str]
) -> tuple[EffectParameter, ...]:
    """An effect's parameters: sizes are neutral at zero, the others only shape it."""
    return tuple(
        EffectParameter(item, 0.0)
        if item.name in sizes
        else EffectParameter(item, item.value, secondary=True)
        for item in parameters
    )


def _vanishes(force: sp.Expr, chosen: Sequence[sp.Symbol]) -> bool:
    try:
        return is_nothing(force.xreplace({symbol: sp.Integer(0) for symbol in chosen}))
    except (TypeError, ValueError, ZeroDivisionError):
        return False  # divided by or compared with nothing


def is_nothing(expression: sp.Expr) -> bool:
    """Whether it is the number zero; 0.0 does not equal 0 in SymPy."""
    return bool(expression.is_Number and expression.is_zero)


def symbol_text(word: str) -> str:
    """A state as it is written; other names as they are."""
    match = PORT.fullmatch(port_of(word))
    if match is None:
        return str(sp.latex(sp.Symbol(word)))
    letter = _LETTERS[match[1]]
    return (letter if word == match[0] else rf"\dot{{{letter}}}") + f"_{{{match[2]}}}"


WIDE = 1e3
"""Times the size of the start: bounds that are there only to be finite."""


def own_parameter(
    name: str,
    start: float,
    unit: str = "",
    lower: float | None = None,
    upper: float | None = None,
) -> Parameter:
    """A parameter of a formula, with `start`, `lower` and `upper` bound in its `unit`; bounds that
    are not stated are wide, with either sign."""
    scale = abs(start) or 1.0
    low = -WIDE * scale if lower is None else lower
    high = WIDE * scale if upper is None else upper
    return Parameter(name, start, unit, low, high, symbol_text(name), name, scale=scale)
