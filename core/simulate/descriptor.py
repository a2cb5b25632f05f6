"""The identified LPV descriptor model in affine terms, for reading and for export.

E(kappa) x' = A(kappa) x + B r, y = C x + D r with x = [q, q', s] and the drive closed, (6-12).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import sympy as sp

from core.arm.arm import Structure
from core.arm.slots import gravity_slot
from core.arm.straight import StraightArm, Terms, straight_arm
from core.forces.element import linear_matrices
from core.model import Model, Numbers
from core.results import DescriptorModel
from core.sensors import sensors


def descriptor(model: Model, numbers: Numbers) -> DescriptorModel:
    """Affine terms at given numbers; the basis functions are readable text."""
    straight = straight_arm(Structure.of(model.arm))
    p, law = numbers.p, numbers.law
    n, ns = model.arm.coordinates, law.states
    mass = _evaluated("mass", straight, p)
    basis = list(mass)
    E_terms = [_block_mass(mass[b], n, ns, constant=b == "1") for b in basis]
    gravity = _gravity_terms(straight, p)
    rest = _evaluated("bending", straight, p)["1"]
    damping = _evaluated("damping", straight, p)["1"]
    K, D = linear_matrices(numbers.elements, np.zeros(n))
    A_terms = {"1": _constant_part(rest + K, damping + D, law, n, ns)}
    for name, K in gravity.items():
        if np.any(K):
            term = A_terms.setdefault(name, np.zeros_like(A_terms["1"]))
            term[n : 2 * n, :n] -= K
    B = np.zeros((2 * n + ns, law.references))
    B[n : n + model.arm.joints] = law.R
    B[2 * n :] = law.Fr
    outputs, C, D = _outputs(model, numbers)
    names = model.arm.coordinate_names
    return DescriptorModel(
        basis=tuple(basis),
        E_terms=np.array(E_terms),
        A_basis=tuple(A_terms),
        A_terms=np.array(list(A_terms.values())),
        B=B,
        outputs=outputs,
        C=C,
        D=D,
        states=(*names, *(f"d{q}" for q in names), *(f"s{i + 1}" for i in range(ns))),
        inputs=_inputs(model, law.references),
    )


def prepare_descriptor(model: Model) -> None:
    """Works out what depends on the arm's structure alone; it is kept."""
    straight = straight_arm(Structure.of(model.arm))
    for which in ("mass", "bending", "damping"):
        _functions(which, straight)
    _gravity_terms(straight, model.numbers().p)


def _inputs(model: Model, count: int) -> tuple[str, ...]:
    names = model.drive.reference_channels(model.arm)
    joints = range(model.arm.joints)
    followed = [f"theta{k + 1}_measured" for k in joints] + [
        f"dtheta{k + 1}_measured" for k in joints
    ]
    return (*names, *followed)[:count]


def _gravity_terms(straight: StraightArm, p: np.ndarray) -> dict[str, np.ndarray]:
    """K's terms that depend on the posture; none where there is no gravity."""
    joints = straight.kinematics.structure.segments
    if not np.any(p[gravity_slot(joints, 0) : gravity_slot(joints, 2)]):
        return {}
    return _evaluated("gravity", straight, p)


_TERMS: dict[str, Callable[[StraightArm], Terms]] = {
    "mass": lambda straight: straight.mass_terms,
    "bending": lambda straight: {sp.Integer(1): straight.bending},
    "damping": lambda straight: {sp.Integer(1): straight.damping},
    "gravity": lambda straight: _split(straight.gravity_stiffness),
}


@cache
def _functions(
    which: str, straight: StraightArm
) -> list[tuple[sp.Expr, Callable[[list[float]], list[list[float]]]]]:
    """Basis function and its matrix as a function of p; made once for a structure."""
    return [
        (basis, sp.lambdify([straight.symbols.p], matrix, "numpy"))
        for basis, matrix in _TERMS[which](straight).items()
    ]


def _evaluated(which: str, straight: StraightArm, p: np.ndarray) -> dict[str, np.ndarray]:
    """Numbers in place of the arm's symbols; the joint coordinates stay in the basis."""
    values = dict(zip(straight.symbols.p, (float(x) for x in p), strict=True))
    joints = set(straight.symbols.theta)
    found: dict[str, np.ndarray] = {}
    n = straight.kinematics.structure.coordinates
    for basis, function in _functions(which, straight):
        shown = basis.subs({s: v for s, v in values.items() if s not in joints})
        numeric = np.asarray(function(p.tolist()), dtype=float)
        factor = 1.0
        if not shown.free_symbols:
            factor, shown = float(shown), sp.Integer(1)
        found[str(shown)] = found.get(str(shown), np.zeros((n, n))) + factor * numeric
    found.setdefault("1", np.zeros((n, n)))
    return {"1": found.pop("1"), **found}


def _split(matrix: sp.Matrix) -> Terms:
    """A matrix linear in cosines and sines as basis function -> matrix."""
    waves = sorted(matrix.atoms(sp.cos, sp.sin), key=str)
    terms: Terms = {}
    rest = matrix
    for wave in waves:
        part = matrix.applyfunc(lambda e, w=wave: sp.expand(e).coeff(w))
        terms[wave] = part
        rest = rest - part * wave
    return {sp.Integer(1): rest.applyfunc(sp.expand), **terms}


def _block_mass(M: np.ndarray, n: int, ns: int, constant: bool) -> np.ndarray:
    E = np.zeros((2 * n + ns, 2 * n + ns))
    E[n : 2 * n, n : 2 * n] = M
    if constant:
        E[:n, :n] = np.eye(n)
        E[2 * n :, 2 * n :] = np.eye(ns)
    return E


def _constant_part(K: np.ndarray, D: np.ndarray, law, n: int, ns: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    joints = len(law.P)
    A = np.zeros((2 * n + ns, 2 * n + ns))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n] = -K
    A[n : 2 * n, n : 2 * n] = -D
    rows = slice(n, n + joints)
    A[rows] -= np.hstack([law.P, law.V, law.S])
    A[2 * n :] = np.hstack([law.Fq, law.Fv, law.Fs])
    return A


def _outputs(model: Model, numbers: Numbers) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    names: list[str] = []
    C, D = [], []
    for kind, sensor in sensors().items():
        if kind in ("y", "ydot") and not model.arm.two_revolute:
            continue
        if sensor.optional and not any(model.arm.elastic):
            continue  # then it is a sensor that is there already
        rows = sensor.rows(model.arm, numbers.p, numbers.law)
        if rows is not None:
            names += [channel.name for channel in sensor.channels(model.arm)]
            C.append(np.hstack([rows.Q, rows.V, rows.S]))
            D.append(rows.R)
    return tuple(names), np.vstack(C), np.vstack(D)
