"""An effect that the user states as a formula."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..arm.chord import deflection_rows
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.formula import LONGEST_NAME, parse_formula
from ..effects.per_joint import joint_direction
from ..effects.per_segment import bending
from ..effects.real_functions import FUNCTIONS
from ..effects.sizes import Sizes
from ..errors import InputError
from ..forces.compiled import compile_law
from ..forces.element import Element
from ..forces.law import ForceLaw
from ..parameters import Parameter
from ..sentences import did_you_mean

MOST_PARAMETERS = 6
"""A formula with more cannot be identified from one residual."""

RATE = "d"
"""Before a port's name: its rate."""

TIP_PORTS = ("z1", "z2")

_NAME = re.compile(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST_NAME - 1}}}")
_PORT = re.compile(r"(theta|delta|z)([1-9])")
_LETTERS = {"theta": r"\theta", "delta": r"\delta", "z": "z"}


@dataclass(frozen=True, kw_only=True)
class OwnEffect(Effect):
    """A joint's torque or a component of the tip's force, added to whatever acts there."""

    kind: str
    title: str
    story: str
    formula: str
    linear: bool
    acts_at: str
    target: str
    ports: tuple[str, ...]
    """What the formula sees: the target first (both components of the tip), then the others."""
    stated: ForceLaw
    own_parameters: tuple[EffectParameter, ...]
    location: str = "own"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return self.own_parameters

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        at_tip = self.ports[0] in TIP_PORTS
        others = self.ports[len(TIP_PORTS) :] if at_tip else self.ports
        directions = tuple(_direction(arm, p, port) for port in others)
        numbers = tuple(values[quantity.parameter.name] for quantity in self.own_parameters)
        return (Element(self.stated, directions, numbers, at_tip),)


class FormulaLaw(ForceLaw):
    """A law in the functions of a formula, compiled with the sign that force laws print."""

    interpreted = True

    def outputs(self) -> tuple[sp.Expr, ...]:
        return tuple(e.replace(FUNCTIONS["sign"], _SIGN) for e in super().outputs())


_SIGN = type("sign", (sp.Function,), {"is_real": True})
"""Without SymPy's own questions about its argument, which can take long."""


def targets(arm: Arm) -> dict[str, str]:
    """What a formula may push, and the port that it does it through."""
    joints = {f"joint{k + 1}": f"theta{k + 1}" for k in range(arm.joints)}
    return {**joints, **{f"tip{port[-1]}": port for port in TIP_PORTS}}


def states(arm: Arm, target: str) -> tuple[str, ...]:
    """The words of a formula that are states: joint positions, deflections of the segments' ends
    in m, at a tip also its place in m, and the rates of all of them."""
    ports = [f"theta{k + 1}" for k in range(arm.joints)]
    ports += [f"delta{k + 1}" for k in bending(arm)]
    ports += TIP_PORTS if targets(arm)[target] in TIP_PORTS else ()
    return tuple(word for port in ports for word in (port, RATE + port))


@lru_cache(maxsize=64)
def own_effect(
    arm: Arm,
    target: str,
    formula: str,
    parameters: tuple[Parameter, ...],
    kind: str,
    title: str = "",
    where: str = "[[model.own]]",
) -> OwnEffect:
    """The effect of a formula in N m at a joint (N on a slide), in N at the tip.

    InputError, with `where` as the place of the settings, for all that is wrong with it. The
    effect vanishes where the smallest possible set of its parameters is zero: those are its
    sizes, the others only shape it.
    """
    ports = targets(arm)
    if target not in ports:
        raise InputError(f"{where} target {target!r} is not known; {did_you_mean(target, ports)}")
    port, names = ports[target], [item.name for item in parameters]
    _check_names(names, where)
    expression = _read(formula, states(arm, target), names, where)
    law = _law(expression, port, names)
    _check_finite(law, parameters, f"{where} formula")
    sizes = _sizes(law, names, f"{where} formula")
    quantities = tuple(
        EffectParameter(item, 0.0)
        if item.name in sizes
        else EffectParameter(item, item.value, secondary=True)
        for item in parameters
    )
    at_tip = port in TIP_PORTS
    return OwnEffect(
        kind=kind,
        title=title or f"Own effect at {target}",
        story=f"Your formula: a force at {target}, {formula.strip()}.",
        formula=_latex(expression, target, port),
        linear=not at_tip and _is_linear(law),
        acts_at="tip" if at_tip else "joints",
        target=target,
        ports=tuple(x.name for x in law.x),
        stated=law,
        own_parameters=quantities,
    )


def _check_names(names: Sequence[str], where: str) -> None:
    if len(names) > MOST_PARAMETERS:
        raise InputError(f"{where} has {len(names)} parameters; give {MOST_PARAMETERS} at most.")
    for name in names:
        if not _NAME.fullmatch(name):
            raise InputError(
                f"{where} parameters: {name!r} is not a valid name; use letters, digits and _, "
                f"with a letter first."
            )
        if name in FUNCTIONS:
            raise InputError(
                f"{where} parameters: {name!r} is the name of a function; choose another."
            )
        if _port(name):
            raise InputError(
                f"{where} parameters: {name!r} is the name of a state; choose another."
            )


def _port(word: str) -> str:
    """The port whose place or rate a word is; '' where it is no state's name."""
    port = word if _PORT.fullmatch(word) else word.removeprefix(RATE)
    return port if _PORT.fullmatch(port) else ""


def _read(formula: str, states: Sequence[str], names: Sequence[str], where: str) -> sp.Expr:
    """The formula in real symbols; every parameter must occur in it."""
    symbols = {word: sp.Symbol(word, real=True) for word in (*states, *names)}
    expression = parse_formula(formula, symbols, f"{where} formula")
    if _nothing(expression):
        raise InputError(f"{where} formula is always zero; leave the effect out.")
    idle = [name for name in names if symbols[name] not in expression.free_symbols]
    if idle:
        raise InputError(
            f"{where} parameters: {idle[0]!r} does not occur in the formula; leave it out."
        )
    return expression


def _law(expression: sp.Expr, port: str, names: Sequence[str]) -> ForceLaw:
    """The formula pushes through the port; through the others it only sees."""
    used = sorted({symbol.name for symbol in expression.free_symbols} - {*names})
    first = TIP_PORTS if port in TIP_PORTS else (port,)
    ports = list(dict.fromkeys((*first, *(_port(word) for word in used))))
    return FormulaLaw(
        x=tuple(sp.Symbol(each, real=True) for each in ports),
        v=tuple(sp.Symbol(RATE + each, real=True) for each in ports),
        forces=tuple(expression if each == port else sp.Integer(0) for each in ports),
        parameters=tuple(sp.Symbol(name, real=True) for name in names),
    )


def _direction(arm: Arm, p: np.ndarray, port: str) -> np.ndarray:
    """(n,) along which a port sees, and pushes."""
    match = _PORT.fullmatch(port)
    assert match is not None
    k = int(match[2]) - 1
    return joint_direction(arm, k) if match[1] == "theta" else deflection_rows(arm, p)[k]


def _check_finite(law: ForceLaw, parameters: Sequence[Parameter], where: str) -> None:
    """Every experiment starts at rest: force and slopes must be finite there."""
    zeros = np.zeros(len(law.x))
    values = np.array([item.value for item in parameters])
    out = compile_law(law)(zeros, zeros, np.zeros(0), values)
    if not np.all(np.isfinite(out)):
        property = "finite" if not np.isfinite(out[: len(zeros)]).all() else "smooth"
        raise InputError(
            f"{where} is not {property} where the arm is stretched and at rest; smooth it there "
            f"with tanh or sqrt(x**2 + 1e-6)."
        )


def _sizes(law: ForceLaw, names: Sequence[str], where: str) -> tuple[str, ...]:
    """The fewest parameters that make the formula zero when they are."""
    force = sp.Add(*law.forces)
    for count in range(1, len(names) + 1):
        for chosen in combinations(law.parameters, count):
            if _vanishes(force, chosen):
                return tuple(symbol.name for symbol in chosen)
    if names:
        raise InputError(
            f"{where} does not become zero when its parameters do; multiply it by one of them, "
            f"which is then the size of the effect."
        )
    return ()


def _vanishes(force: sp.Expr, chosen: Sequence[sp.Symbol]) -> bool:
    try:
        return _nothing(force.xreplace({symbol: sp.Integer(0) for symbol in chosen}))
    except (TypeError, ValueError, ZeroDivisionError):
        return False  # divided by or compared with nothing


def _nothing(expression: sp.Expr) -> bool:
    """Whether it is the number zero; 0.0 does not equal 0 in SymPy."""
    return bool(expression.is_Number and expression.is_zero)


def _is_linear(law: ForceLaw) -> bool:
    """Whether the force is linear in the states and has no constant part."""
    force, states = sp.Add(*law.forces), (*law.x, *law.v)
    constant = force.xreplace({symbol: sp.Integer(0) for symbol in states})
    slopes = [sp.diff(force, symbol) for symbol in states]
    return _nothing(constant) and not any(s.free_symbols & set(states) for s in slopes)


def _latex(expression: sp.Expr, target: str, port: str) -> str:
    left = rf"F_{{z{port[-1]}}}" if port in TIP_PORTS else rf"\tau_{{{target[-1]}}}"
    names = {s: _symbol(s.name) for s in expression.free_symbols}
    return f"{left} = {sp.latex(expression, symbol_names=names)}"


def _symbol(word: str) -> str:
    """A state as it is written; other names as they are."""
    match = _PORT.fullmatch(_port(word))
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
    """A parameter of a formula; bounds that are not stated are wide, with either sign."""
    scale = abs(start) or 1.0
    low = -WIDE * scale if lower is None else lower
    high = WIDE * scale if upper is None else upper
    return Parameter(name, start, unit, low, high, _symbol(name), name, scale=scale)
