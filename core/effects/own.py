"""An effect that the user states as a formula."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..arm.chord import deflection_rows
from ..drives.drive import Drive
from ..effects.bristle import IDEALISED, breakaway
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.formula_functions import (
    FORMULA_FUNCTIONS,
    Bristle,
    Friction,
    bristles_in,
    with_expanded_tables,
)
from ..effects.own_formula import (
    PORT,
    RATE,
    check_names,
    effect_parameters,
    is_nothing,
    port_of,
    read_formula,
    size_names,
    symbol_text,
)
from ..effects.per_joint import joint_direction
from ..effects.per_segment import bending
from ..effects.sizes import Sizes
from ..errors import InputError
from ..forces.compiled import compile_law
from ..forces.element import Element
from ..forces.law import ForceLaw
from ..parameters import Parameter
from ..recording.inputs import INPUTS
from ..sentences import did_you_mean

TIP_PORTS = ("z1", "z2")

_SHARE = sp.Symbol("_share", real=True)
"""State of a bristle; no parameter can have this name."""


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
    loads: tuple[int, ...] = ()
    """Drives, from 0, whose torques the formula sees."""
    inputs: tuple[str, ...] = ()
    idealised: float = 0.0
    own_parameters: tuple[EffectParameter, ...]
    location: str = "own"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return self.own_parameters

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        at_tip = self.ports[0] in TIP_PORTS
        others = self.ports[len(TIP_PORTS) :] if at_tip else self.ports
        directions = tuple(_direction(arm, p, port) for port in others)
        numbers = tuple(values[quantity.parameter.name] for quantity in self.own_parameters)
        numbers += (0.0,) * (len(self.loads) + len(self.inputs))
        return (Element(self.stated, directions, numbers, at_tip, self.loads, self.inputs),)


class FormulaLaw(ForceLaw):
    """A law in the functions of a formula, compiled with the sign that force laws print."""

    interpreted = True

    def outputs(self) -> tuple[sp.Expr, ...]:
        return tuple(e.replace(FORMULA_FUNCTIONS["sign"], _SIGN) for e in super().outputs())


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


def torques(arm: Arm) -> tuple[str, ...]:
    """The words of a formula that are drives' torques, N m (N on a slide)."""
    return tuple(f"u{k + 1}" for k in range(arm.joints))


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
    """The effect of a formula in N m at a joint (N on a slide), in N at the tip. It sees the arm's
    states, the drives' torques, the time `t`, and what is recorded as input1, input2 and input3.

    InputError, with `where` as the place of the settings, for all that is wrong with it. The
    effect vanishes where the smallest possible set of its parameters is zero: those are its
    sizes, the others only shape it.
    """
    ports = targets(arm)
    if target not in ports:
        raise InputError(f"{where} target {target!r} is not known; {did_you_mean(target, ports)}")
    port, names = ports[target], [item.name for item in parameters]
    check_names(names, where)
    signals = (*torques(arm), *INPUTS)
    expression = read_formula(formula, (*states(arm, target), *signals), names, where)
    used = {symbol.name for symbol in expression.free_symbols}
    loads = tuple(k for k, word in enumerate(torques(arm)) if word in used)
    inputs = tuple(word for word in INPUTS if word in used)
    written = [*(torques(arm)[k] for k in loads), *inputs]
    law = _law(arm, expression, port, [*names, *written], f"{where} formula")
    _check_finite(law, parameters, f"{where} formula")
    sizes = size_names(sp.Add(*law.forces), law.parameters[: len(names)], f"{where} formula")
    quantities = effect_parameters(parameters, sizes)
    at_tip = port in TIP_PORTS
    return OwnEffect(
        kind=kind,
        title=title or f"Own effect at {target}",
        story=f"Your formula: a force at {target}, {formula.strip()}.",
        formula=_latex(expression, target, port),
        linear=not at_tip and not written and _is_linear(law),
        acts_at="tip" if at_tip else "joints",
        target=target,
        ports=tuple(x.name for x in law.x),
        stated=law,
        own_parameters=quantities,
        loads=loads,
        inputs=inputs,
        idealised=IDEALISED if law.states else 0.0,
    )


def _law(arm: Arm, formula: sp.Expr, port: str, names: Sequence[str], where: str) -> ForceLaw:
    """The formula pushes through the port; through the others it only sees."""
    expression = with_expanded_tables(formula, where)
    bristle, rate = _bristle(arm, expression, port, where)
    expression = expression.xreplace({bristle: _SHARE}) if rate is not None else expression
    used = sorted({symbol.name for symbol in expression.free_symbols} - {*names, _SHARE.name})
    first = TIP_PORTS if port in TIP_PORTS else (port,)
    ports = list(dict.fromkeys((*first, *(port_of(word) for word in used))))
    if isinstance(bristle, Friction) and len(ports) > 1:
        raise InputError(
            f"{where}: {bristle} can depend on joint {port[-1]}, on drive torques, t and inputs "
            f"alone; use hysteresis({port}, ...) where it depends on more."
        )
    return FormulaLaw(
        x=tuple(sp.Symbol(each, real=True) for each in ports),
        v=tuple(sp.Symbol(RATE + each, real=True) for each in ports),
        forces=tuple(expression if each == port else sp.Integer(0) for each in ports),
        parameters=tuple(sp.Symbol(name, real=True) for name in names),
        states=() if rate is None else (_SHARE,),
        rates=() if rate is None else (rate,),
        bristle=rate is not None and len(ports) == 1,
    )


def _bristle(
    arm: Arm, expression: sp.Expr, port: str, where: str
) -> tuple[Bristle | None, sp.Expr | None]:
    """The friction or hysteresis of a formula and its rate; None where there is none."""
    found = bristles_in(expression)
    if not found:
        return None, None
    x, v = sp.Symbol(port, real=True), sp.Symbol(RATE + port, real=True)
    if len(found) > 1 or found[0].args[0] != x or port in TIP_PORTS:
        raise InputError(
            f"{where}: write one friction or hysteresis, of the position of the joint that the "
            f"formula acts at, as in {found[0].word}({'theta1' if port in TIP_PORTS else port}"
            f"{', s' if len(found[0].args) > 1 else ''})."
        )
    way = found[0].args[1] if len(found[0].args) > 1 else breakaway(arm, int(port[-1]) - 1, {})
    return found[0], (v - FORMULA_FUNCTIONS["abs"](v) * _SHARE) / way


def _direction(arm: Arm, p: np.ndarray, port: str) -> np.ndarray:
    """(n,) along which a port sees, and pushes."""
    match = PORT.fullmatch(port)
    assert match is not None
    k = int(match[2]) - 1
    return joint_direction(arm, k) if match[1] == "theta" else deflection_rows(arm, p)[k]


def _check_finite(law: ForceLaw, parameters: Sequence[Parameter], where: str) -> None:
    """Every experiment starts at rest: force and slopes must be finite there."""
    zeros = np.zeros(len(law.x))
    values = np.zeros(len(law.parameters))
    values[: len(parameters)] = [item.value for item in parameters]
    out = compile_law(law)(zeros, zeros, np.zeros(len(law.states)), values)
    if not np.all(np.isfinite(out)):
        property = "finite" if not np.isfinite(out[: len(zeros)]).all() else "smooth"
        raise InputError(
            f"{where} is not {property} where the arm is stretched and at rest; smooth it there "
            f"with tanh or sqrt(x**2 + 1e-6)."
        )


def _is_linear(law: ForceLaw) -> bool:
    """Whether the force is linear in the states and has no constant part."""
    force, states = sp.Add(*law.forces), (*law.x, *law.v)
    constant = force.xreplace({symbol: sp.Integer(0) for symbol in states})
    slopes = [sp.diff(force, symbol) for symbol in states]
    curved = law.states or any(s.free_symbols & set(states) for s in slopes)
    return is_nothing(constant) and not curved


def _latex(expression: sp.Expr, target: str, port: str) -> str:
    left = rf"F_{{z{port[-1]}}}" if port in TIP_PORTS else rf"\tau_{{{target[-1]}}}"
    names = {s: symbol_text(s.name) for s in expression.free_symbols}
    return f"{left} = {sp.latex(expression, symbol_names=names)}"
