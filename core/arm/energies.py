"""Energies of an arm, in symbols: kinetic, elastic, and the dissipation."""

from __future__ import annotations

import sympy as sp

from ..arm import shapes
from ..arm.kinematics import Kinematics
from ..arm.slots import (
    DAMPING_TIME,
    HUB_INERTIA,
    INERTIA,
    LENGTH,
    ROTOR_INERTIA,
    STIFFNESS,
    TIP_INERTIA,
    TWIST_STIFFNESS,
)


def bending(kinematics: Kinematics) -> sp.Expr:
    """V_b = sum_k 1/2 EI_k int delta_k''^2 dx."""
    s = kinematics.symbols
    return sp.Add(
        *[
            shapes.bending_energy(s.modal[k], s.slot(k, LENGTH), s.slot(k, STIFFNESS))
            for k in range(kinematics.structure.segments)
        ]
    )


def springs(kinematics: Kinematics) -> sp.Expr:
    """Energy of the elastic joints, 1/2 k twist^2, of an elastic base and of a pedestal."""
    s = kinematics.symbols
    twists = [s.slot(k, TWIST_STIFFNESS) * t**2 / 2 for k, t in enumerate(s.twist)]
    turning = s.pedestal_stiffness * s.pedestal**2 / 2
    return sp.Add(*twists, *[s.base_stiffness * b**2 / 2 for b in s.base], turning)


def dissipation(kinematics: Kinematics) -> sp.Expr:
    """Rayleigh's function of Kelvin-Voigt beams: tau_k times the bending energy of the rates."""
    s = kinematics.symbols
    rates = dict(zip(s.q, s.dq, strict=True))
    terms = []
    for k in range(kinematics.structure.segments):
        speeds = [rates[v] for v in s.modal[k]]
        energy = shapes.bending_energy(speeds, s.slot(k, LENGTH), s.slot(k, STIFFNESS))
        terms.append(s.slot(k, DAMPING_TIME) * energy)
    return sp.Add(*terms)


def stiffness_matrix(kinematics: Kinematics) -> sp.Matrix:
    """(n, n) Hessian of the elastic energy."""
    energy = bending(kinematics) + springs(kinematics)
    return sp.hessian(energy, kinematics.symbols.q)


def damping_matrix(kinematics: Kinematics) -> sp.Matrix:
    """(n, n) Hessian of the dissipation in the rates."""
    return sp.hessian(dissipation(kinematics), kinematics.symbols.dq)


def lumped_inertia(kinematics: Kinematics) -> sp.Matrix:
    """(n, n) constant part of M: hubs 1/2 Jh theta'^2, rotors without a gear 1/2 Jr (omega +
    theta')^2 with the rate omega of the segment's end that carries them, tip inertias
    1/2 Jt phi_tip'^2, rigid segments about their centres of mass, and that of a pedestal."""
    s = kinematics.symbols
    n = kinematics.structure.coordinates
    turned = sp.Matrix([s.pedestal]).jacobian(s.q)
    total = sp.zeros(n, n) + s.pedestal_inertia * turned.T * turned
    for k in range(kinematics.structure.segments):
        total[k, k] += s.slot(k, HUB_INERTIA)
        slope = sp.Matrix([kinematics.tip_angle(k)]).jacobian(s.q)
        turning = s.slot(k, TIP_INERTIA)
        if not s.modal[k]:
            turning += s.slot(k, INERTIA)
        total += turning * slope.T * slope
        rotor = sp.Matrix([kinematics.rotor_angle(k)]).jacobian(s.q)
        total += s.slot(k, ROTOR_INERTIA) * rotor.T * rotor
    return total
