"""The affine terms of `descriptor`, a hundred times faster: derived once per structure.

A slider changes numbers, not the structure, so the terms are kept as compiled expressions of p.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from functools import cache, cached_property

import numpy as np
import sympy as sp

from core.arm.arm import Structure
from core.arm.kinematics import Kinematics
from core.arm.slots import gravity_slot
from core.arm.straight import StraightArm, Terms
from core.forces.element import linear_matrices
from core.model import Model, Numbers
from core.results import DescriptorModel
from core.simulate import descriptor as slow

Evaluate = Callable[..., list[np.ndarray]]


class AffineTerms:
    """Inertia and gravity stiffness of the straight arm of one structure."""

    def __init__(self, structure: Structure) -> None:
        self._straight = StraightArm(Kinematics(structure))
        self._parameters = self._straight.symbols.p

    def mass(self, p: np.ndarray) -> dict[str, np.ndarray]:
        """Basis function as text -> (n, n); '1' stands first."""
        return self._evaluated(*self._mass, p)

    def gravity(self, p: np.ndarray) -> dict[str, np.ndarray]:
        """The same of -dF/dq from gravity."""
        return self._evaluated(*self._gravity, p)

    @cached_property
    def _mass(self) -> tuple[list[sp.Expr], Evaluate]:
        return self._prepared(self._straight.mass_terms)

    @cached_property
    def _gravity(self) -> tuple[list[sp.Expr], Evaluate]:
        return self._prepared(slow._split(self._straight.gravity_stiffness))

    def _prepared(self, terms: Terms) -> tuple[list[sp.Expr], Evaluate]:
        """Basis functions, and one compiled function of p for all their matrices."""
        flat = [list(matrix) for matrix in terms.values()]
        return list(terms), sp.lambdify(self._parameters, flat, modules="numpy", cse=True)

    def _evaluated(
        self, bases: list[sp.Expr], evaluate: Evaluate, p: np.ndarray
    ) -> dict[str, np.ndarray]:
        numbers = [float(x) for x in p]
        n = self._straight.kinematics.structure.coordinates
        found: dict[str, np.ndarray] = defaultdict(lambda: np.zeros((n, n)))
        for basis, flat in zip(bases, evaluate(*numbers), strict=True):
            text, factor = self._named(basis, numbers)
            found[text] = found[text] + factor * np.array(flat, dtype=float).reshape(n, n)
        return {"1": found.pop("1", np.zeros((n, n))), **found}

    def _named(self, basis: sp.Expr, numbers: list[float]) -> tuple[str, float]:
        """(readable text, factor); only the directions of slides are parameters in a basis."""
        inside = basis.free_symbols & set(self._parameters)
        shown = basis
        if inside:
            pairs = zip(self._parameters, numbers, strict=True)
            shown = basis.subs({s: x for s, x in pairs if s in inside})
        return (str(shown), 1.0) if shown.free_symbols else ("1", float(shown))


@cache
def affine_terms(structure: Structure) -> AffineTerms:
    """The terms of a structure; a fraction of a second the first time."""
    return AffineTerms(structure)


def quick_descriptor(model: Model, numbers: Numbers) -> DescriptorModel:
    """The same as `descriptor.descriptor`, quick enough to follow a slider."""
    p, law = numbers.p, numbers.law
    n, ns = model.arm.coordinates, law.states
    terms = affine_terms(Structure.of(model.arm))
    mass = terms.mass(p)
    at_rest = p.copy()
    weight = slice(gravity_slot(model.arm.joints, 0), gravity_slot(model.arm.joints, 2))
    at_rest[weight] = 0.0
    K, D = model.compiled.linear_matrices(np.zeros(n), at_rest)
    K_extra, D_extra = linear_matrices(numbers.elements, np.zeros(n))
    A_terms = {"1": slow._constant_part(K + K_extra, D + D_extra, law, n, ns)}
    if np.any(p[weight]):
        for name, part in terms.gravity(p).items():
            if np.any(part):
                term = A_terms.setdefault(name, np.zeros_like(A_terms["1"]))
                term[n : 2 * n, :n] -= part
    B = np.zeros((2 * n + ns, law.references))
    B[n : n + model.arm.joints], B[2 * n :] = law.R, law.Fr
    outputs, C, direct = slow._outputs(model, numbers)
    names = model.arm.coordinate_names
    return DescriptorModel(
        basis=tuple(mass),
        E_terms=np.array([slow._block_mass(m, n, ns, constant=b == "1") for b, m in mass.items()]),
        A_basis=tuple(A_terms),
        A_terms=np.array(list(A_terms.values())),
        B=B,
        outputs=outputs,
        C=C,
        D=direct,
        states=(*names, *(f"d{q}" for q in names), *(f"s{i + 1}" for i in range(ns))),
        inputs=slow._inputs(model, law.references),
    )
