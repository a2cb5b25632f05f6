"""The identified LPV descriptor model in affine terms, for reading and for export.

E(kappa) x' = A(kappa) x + B r, y = C x + D r with x = [q, q', s] and the drive closed, (6-12). A
slider changes numbers, not the structure, so the terms are kept as compiled expressions of p.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from functools import cache

import numpy as np
import sympy as sp

from ..arm.arm import Structure
from ..arm.slots import gravity_slot
from ..arm.straight import StraightArm, Terms, straight_arm
from ..model import Model, Numbers
from ..results import DescriptorModel
from ..sensors import sensors
from ..simulate.posture import posture


def descriptor(model: Model, numbers: Numbers) -> DescriptorModel:
    """Affine terms at given numbers; the basis functions are readable text."""
    p, law = numbers.p, numbers.law
    n, ns = model.arm.coordinates, law.states
    straight = straight_arm(Structure.of(model.arm))
    mass = _evaluated(straight, _mass, p)
    weightless, weight = p.copy(), _weight(model)
    weightless[weight] = 0.0
    here = posture(model, np.zeros(model.arm.joints), numbers._replace(p=weightless))
    A_terms = {"1": here.A}
    if np.any(p[weight]):
        for name, part in _evaluated(straight, _gravity, p).items():
            term = A_terms.setdefault(name, np.zeros_like(A_terms["1"]))
            term[n : 2 * n, :n] -= part
    outputs, C, direct = _outputs(model, numbers)
    names = model.arm.coordinate_names
    return DescriptorModel(
        basis=tuple(mass),
        E_terms=np.array([_block_mass(m, n, ns, constant=b == "1") for b, m in mass.items()]),
        A_basis=tuple(A_terms),
        A_terms=np.array(list(A_terms.values())),
        B=here.B,
        outputs=outputs,
        C=C,
        D=direct,
        states=(*names, *(f"d{q}" for q in names), *(f"s{i + 1}" for i in range(ns))),
        inputs=_inputs(model, law.references),
    )


def prepare_descriptor(model: Model) -> None:
    """Works out what depends on the arm's structure alone; it is kept."""
    descriptor(model, model.numbers())


def _weight(model: Model) -> slice:
    """Where p has gravity."""
    return slice(gravity_slot(model.arm.joints, 0), gravity_slot(model.arm.joints, 2))


def _inputs(model: Model, count: int) -> tuple[str, ...]:
    names = model.drive.reference_channels(model.arm)
    joints = range(model.arm.joints)
    followed = [f"theta{k + 1}_measured" for k in joints] + [
        f"dtheta{k + 1}_measured" for k in joints
    ]
    return (*names, *followed)[:count]


def _mass(straight: StraightArm) -> Terms:
    return straight.mass_terms


def _gravity(straight: StraightArm) -> Terms:
    """Of -dF/dq."""
    return _split(straight.gravity_stiffness)


@cache
def _prepared(
    straight: StraightArm, which: Callable[[StraightArm], Terms]
) -> tuple[list[sp.Expr], Callable[..., list[np.ndarray]]]:
    """Basis functions, and one compiled function of p for all their matrices."""
    terms = which(straight)
    flat = [list(matrix) for matrix in terms.values()]
    return list(terms), sp.lambdify(straight.symbols.p, flat, modules="numpy", cse=True)


def _evaluated(
    straight: StraightArm, which: Callable[[StraightArm], Terms], p: np.ndarray
) -> dict[str, np.ndarray]:
    """Basis function as text -> (n, n), where it is not zero; '1' stands first."""
    bases, evaluate = _prepared(straight, which)
    numbers = dict(zip(straight.symbols.p, (float(x) for x in p), strict=True))
    n = straight.kinematics.structure.coordinates
    matrices: dict[str, np.ndarray] = defaultdict(lambda: np.zeros((n, n)))
    for basis, flat in zip(bases, evaluate(*numbers.values()), strict=True):
        # Only the directions of slides are parameters in a basis.
        shown = basis.subs({s: x for s, x in numbers.items() if s in basis.free_symbols})
        text, factor = (str(shown), 1.0) if shown.free_symbols else ("1", float(shown))
        matrices[text] = matrices[text] + factor * np.array(flat, dtype=float).reshape(n, n)
    constant = matrices.pop("1", np.zeros((n, n)))
    return {"1": constant, **{name: matrix for name, matrix in matrices.items() if matrix.any()}}


def _split(matrix: sp.Matrix) -> Terms:
    """A matrix linear in cosines and sines as basis function -> matrix."""
    waves = sorted(matrix.atoms(sp.cos, sp.sin), key=str)
    terms: Terms = {}
    remainder = matrix
    for wave in waves:
        part = matrix.applyfunc(lambda e, w=wave: sp.expand(e).coeff(w))
        terms[wave] = part
        remainder = remainder - part * wave
    return {sp.Integer(1): remainder.applyfunc(sp.expand), **terms}


def _block_mass(M: np.ndarray, n: int, ns: int, constant: bool) -> np.ndarray:
    E = np.zeros((2 * n + ns, 2 * n + ns))
    E[n : 2 * n, n : 2 * n] = M
    if constant:
        E[:n, :n] = np.eye(n)
        E[2 * n :, 2 * n :] = np.eye(ns)
    return E


def _outputs(model: Model, numbers: Numbers) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    names: list[str] = []
    C, D = [], []
    for kind, sensor in sensors().items():
        if kind in ("y", "ydot") and not model.arm.two_revolute:
            continue
        if not sensor.is_stated(model.arm):
            continue
        rows = sensor.rows(model.arm, numbers.p, numbers.law)
        if rows is not None:
            names += [channel.name for channel in sensor.channels(model.arm)]
            C.append(np.hstack([rows.Q, rows.V, rows.S]))
            D.append(rows.R)
    return tuple(names), np.vstack(C), np.vstack(D)
