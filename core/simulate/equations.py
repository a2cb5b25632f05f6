"""The displayed equations of a model, from the same symbols as the compiled ones."""

from __future__ import annotations

from functools import cache

import sympy as sp

from ..arm import shapes
from ..arm.arm import Structure
from ..arm.energies import bending, dissipation, springs, stiffness_matrix
from ..arm.kinematics import Kinematics, Phasor, components
from ..arm.slots import (
    AXIS_ANGLE,
    CENTRE_ACROSS,
    CENTRE_ALONG,
    DAMPING_TIME,
    HUB_INERTIA,
    INERTIA,
    LENGTH,
    MASS,
    ROTOR_INERTIA,
    TIP_INERTIA,
    TIP_MASS,
    slot,
)
from ..arm.straight import straight_arm
from ..arm.symbols import Symbols
from ..model import Model
from ..results import Equation
from ..sensors.rigid_rates import rigid_angle_matrix
from ..sentences import first_sentence

LARGEST_MATRIX = 6
"""Coordinates up to which the terms of M are shown; larger ones fill pages."""


def equations(model: Model) -> tuple[Equation, ...]:
    """What a person reads to know the model: kinematics, energies, dynamics, LPV form."""
    kinematics = Kinematics(Structure.of(model.arm))
    # Terms that the arm does not have are left out of the display.
    absent = _absent(model, kinematics)
    return (
        *_kinematics(kinematics, absent),
        *_energies(kinematics, model, absent),
        *_dynamics(model),
        *_effects(model),
        *_straight(kinematics, model, absent),
    )


def prepare_equations(model: Model) -> None:
    """Works out the form of the straight arm, which takes longest and is kept."""
    kinematics = Kinematics(Structure.of(model.arm))
    _straight(kinematics, model, _absent(model, kinematics))


def _absent(model: Model, kinematics: Kinematics) -> dict[sp.Symbol, sp.Expr]:
    """Symbols whose value is exactly zero in this arm, and those that follow from others: centre
    and inertia of a uniform beam."""
    p = model.numbers().p
    optional = (
        TIP_MASS, TIP_INERTIA, HUB_INERTIA, ROTOR_INERTIA, DAMPING_TIME, AXIS_ANGLE, CENTRE_ACROSS
    )  # fmt: skip
    symbols = kinematics.symbols
    absent = {
        symbols.slot(k, which): sp.Integer(0)
        for k in range(model.arm.joints)
        for which in optional
        if p[slot(k, which)] == 0.0
    }
    for k, segment in enumerate(model.arm.segments):
        length = symbols.slot(k, LENGTH)
        if segment.centre_of_mass is None:
            absent[symbols.slot(k, CENTRE_ALONG)] = length / 2
        if segment.inertia is None:
            absent[symbols.slot(k, INERTIA)] = symbols.slot(k, MASS) * length**2 / 12
    pairs = zip(symbols.gravity, model.arm.gravity, strict=True)
    return absent | {g: sp.Integer(0) for g, value in pairs if value == 0.0}


def _shown(place: tuple[Phasor, ...], absent: dict[sp.Symbol, sp.Expr]) -> tuple[Phasor, ...]:
    """The phasors with what the arm does not have left out."""
    return tuple(
        Phasor(*(part.xreplace(absent) for part in (f.angle, f.along, f.across))) for f in place
    )


def _kinematics(kinematics: Kinematics, absent: dict[sp.Symbol, sp.Expr]) -> list[Equation]:
    s = kinematics.symbols
    equations = []
    for k, v in enumerate(s.modal):
        if not v:
            continue
        bend = s.latex(shapes.deflection(v, s.x))
        short = s.latex(shapes.foreshortening(v, s.x))
        equations.append(
            Equation(
                f"Bending of segment {k + 1}",
                rf"\delta_{{{k + 1}}}(x) = {bend}, \qquad u_{{{k + 1}}}(x) = {short}",
                "Assumed modes and the shortening of the axis to second order.",
            )
        )
    tip = _shown(kinematics.tip(), absent)
    angles = _named_angles(tip)
    z = components(tuple(Phasor(angles[f.angle], f.along, f.across) for f in tip))
    shown = [rf"\varphi_{{{i + 1}}} &= {s.latex(a)}" for i, a in enumerate(angles)]
    names = {symbol: rf"\varphi_{{{i + 1}}}" for i, symbol in enumerate(angles.values())}
    rows = [
        rf"z_{i + 1} &= {sp.latex(row.xreplace(absent), symbol_names=s.latex_names | names)}"
        for i, row in enumerate(z)
    ]
    body = r" \\ ".join(shown + rows)
    note = "Place of the end effector, equation (3) of the paper for two one-mode segments."
    equations.append(Equation("End effector", rf"\begin{{aligned}} {body} \end{{aligned}}", note))
    return equations


def _named_angles(place: tuple[Phasor, ...]) -> dict[sp.Expr, sp.Symbol]:
    """Each direction that occurs, with a short symbol for it."""
    symbols: dict[sp.Expr, sp.Symbol] = {}
    for f in place:
        symbols.setdefault(f.angle, sp.Symbol(f"phi{len(symbols) + 1}", real=True))
    return symbols


def _energies(
    kinematics: Kinematics, model: Model, absent: dict[sp.Symbol, sp.Expr]
) -> list[Equation]:
    s = kinematics.symbols
    parts = []
    for k in range(model.arm.joints):
        length = s.latex(s.slot(k, LENGTH))
        parts += _own_energy(s, k, absent)
        if s.slot(k, TIP_MASS) not in absent:
            tip = s.latex(s.slot(k, TIP_MASS))
            parts.append(rf"\tfrac{{1}}{{2}} {tip} \| \dot{{p}}_{{{k + 1}}}({length}) \|^2")
        if s.slot(k, HUB_INERTIA) not in absent:
            hub = s.latex(s.slot(k, HUB_INERTIA))
            parts.append(rf"\tfrac{{1}}{{2}} {hub} \dot{{\theta}}_{{{k + 1}}}^2")
        if s.slot(k, ROTOR_INERTIA) not in absent:
            rotor = s.latex(s.slot(k, ROTOR_INERTIA))
            carried = rf"\omega_{{{k}}} + " if model.arm.carries_motor(k) else ""
            parts.append(rf"\tfrac{{1}}{{2}} {rotor} ({carried}\dot{{\theta}}_{{{k + 1}}})^2")
        if s.slot(k, TIP_INERTIA) not in absent:
            tip = s.latex(s.slot(k, TIP_INERTIA))
            parts.append(rf"\tfrac{{1}}{{2}} {tip} \dot{{\varphi}}_{{t,{k + 1}}}^2")
    rates = any(r"\omega" in part for part in parts)
    note = "ω is the rate at which the end of a segment turns." if rates else ""
    equations = [Equation("Kinetic energy", "T = " + " + ".join(parts), note)]
    energy = bending(kinematics)
    if energy != 0:
        equations.append(Equation("Bending energy", rf"V = {s.latex(energy)}"))
    spring = springs(kinematics)
    if spring != 0:
        equations.append(Equation("Elastic joints and base", rf"V_s = {s.latex(spring)}"))
    loss = dissipation(kinematics).xreplace(absent)
    if loss != 0:
        equations.append(Equation("Dissipation", rf"R = {s.latex(loss)}", "Kelvin-Voigt beams."))
    return equations


def _own_energy(s: Symbols, k: int, absent: dict[sp.Symbol, sp.Expr]) -> list[str]:
    """Of a segment's own mass, spread evenly or as stated."""
    m, length = s.latex(s.slot(k, MASS)), s.latex(s.slot(k, LENGTH))
    symbols = [s.slot(k, which) for which in (CENTRE_ALONG, CENTRE_ACROSS, INERTIA)]
    if s.modal[k] or all(symbol in absent for symbol in symbols):
        speed = rf"\| \dot{{p}}_{{{k + 1}}}(x) \|^2"
        return [rf"\frac{{{m}}}{{2 {length}}} \int_0^{{{length}}} {speed} \, dx"]
    along, across, inertia = (absent.get(symbol, symbol) for symbol in symbols)
    centre = ", ".join(s.latex(e) for e in (along, across) if e != 0) or "0"
    return [
        rf"\tfrac{{1}}{{2}} {m} \| \dot{{p}}_{{{k + 1}}}({centre}) \|^2",
        rf"\tfrac{{1}}{{2}} {s.latex(inertia)} \omega_{{{k + 1}}}^2",
    ]


def _dynamics(model: Model) -> list[Equation]:
    equations = [
        Equation(
            "Equations of motion",
            r"M(q)\, \ddot{q} = F(q, \dot{q}) + G u, "
            r"\qquad G = \begin{bmatrix} I \\ 0 \end{bmatrix}",
            "By virtual work, equation (1) of the paper.",
        )
    ]
    return (
        [*equations, Equation("Drive", model.drive.latex())] if model.drive.latex() else equations
    )


def _effects(model: Model) -> list[Equation]:
    """What each effect of the model adds, in the order in which they enter."""
    return [
        Equation(f"Effect: {effect.title}", effect.formula, first_sentence(effect.story))
        for effect in model.effects
        if effect.formula
    ]


def _straight(
    kinematics: Kinematics, model: Model, absent: dict[sp.Symbol, sp.Expr]
) -> list[Equation]:
    equations = list(_lpv_form(kinematics.structure, frozenset(absent.items())))
    return [*equations, _rigid(model)] if model.arm.two_revolute else equations


@cache
def _lpv_form(
    structure: Structure, absent: frozenset[tuple[sp.Symbol, sp.Expr]]
) -> tuple[Equation, ...]:
    """Made once for a structure and what it lacks: it takes long."""
    straight, instead = straight_arm(structure), dict(absent)
    s = straight.symbols
    terms = {
        b.xreplace(instead): m
        for b, m in straight.mass_terms.items()
        if any(entry.xreplace(instead) != 0 for entry in m)
    }
    pieces = [rf"M_{{{i}}}" + ("" if b == 1 else rf"\, {s.latex(b)}") for i, b in enumerate(terms)]
    equations = [
        Equation(
            "LPV descriptor form",
            r"E(\kappa) \dot{x} = A x + B r, \quad "
            r"E = \begin{bmatrix} I & 0 \\ 0 & M(\kappa) \end{bmatrix}, \quad "
            r"A = \begin{bmatrix} 0 & I \\ -K & -D \end{bmatrix}, \quad "
            rf"M(\kappa) = {' + '.join(pieces)}",
            "Equations (6-7); the drive's feedback is part of K and D, (11).",
        )
    ]
    if len(s.q) <= LARGEST_MATRIX:
        for i, (basis, matrix) in enumerate(terms.items()):
            shown = matrix.xreplace(instead).applyfunc(sp.factor)
            role = "constant part" if basis == 1 else f"multiplies {basis}"
            equations.append(Equation(f"M{i}, {role}", rf"M_{{{i}}} = {_matrix(s, shown)}"))
        stiffness = stiffness_matrix(straight.kinematics)
        if stiffness != sp.zeros(*stiffness.shape):
            equations.append(Equation("Stiffness", rf"K = {_matrix(s, stiffness)}"))
    return tuple(equations)


def _matrix(s, matrix: sp.Matrix) -> str:  # type: ignore[no-untyped-def]
    rows = [" & ".join(s.latex(e) for e in matrix.row(i)) for i in range(matrix.rows)]
    return r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"


def _rigid(model: Model) -> Equation:
    C1 = rigid_angle_matrix(model.arm, model.numbers().p)
    rows = [" & ".join(f"{x:.4g}" for x in row) for row in C1]
    matrix = r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"
    return Equation(
        "Fictitious rigid arm",
        rf"\bar{{y}} = \dot{{y}} = [\, 0 \;\; C_1 \,]\, x, \qquad C_1 = {matrix}",
        "Equations (9) and (12): the joint velocities of a rigid arm with the same tip.",
    )
