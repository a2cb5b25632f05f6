"""The inertia and gravity of the straight arm (v = 0), term by term.

With the arm straight, M is a sum of products of constants with cosines and sines of the angles
between the segments. Writing places as phasors gives those terms without any trigonometric
expansion: M_ij = sum_ab Re(conj(c_ia) c_jb exp(i (phi_b - phi_a))).
"""

from __future__ import annotations

from collections import defaultdict
from functools import cache, cached_property

import sympy as sp

from ..arm.arm import Structure
from ..arm.energies import lumped_inertia
from ..arm.kinematics import Kinematics, Place
from ..arm.slots import LENGTH, MASS, TIP_MASS

Terms = dict[sp.Expr, sp.Matrix]
"""Basis function of the joint coordinates -> constant matrix (n, n)."""


class StraightArm:
    """M and the stiffness by gravity at v = 0 as functions of the joint coordinates."""

    def __init__(self, kinematics: Kinematics) -> None:
        self.kinematics = kinematics
        self.symbols = kinematics.symbols
        self._at_rest = self.symbols.straight

    @cached_property
    def mass_terms(self) -> Terms:
        """E's lower right block: basis function -> (n, n); '1' is the constant part."""
        n = self.kinematics.structure.coordinates
        terms: Terms = defaultdict(lambda: sp.zeros(n, n))
        terms[sp.Integer(1)] += lumped_inertia(self.kinematics)
        s = self.symbols
        for k in range(self.kinematics.structure.segments):
            self._add_mass(terms, *self._spread(k))
            self._add_mass(terms, self.kinematics.segment_tip(k), s.slot(k, TIP_MASS), None)
        return {basis: matrix for basis, matrix in terms.items() if matrix != sp.zeros(n, n)}

    def _spread(self, segment: int) -> tuple[Place, sp.Expr, sp.Expr | None]:
        """Where a segment's mass is, how much per length, and the length it is spread along: a
        rigid segment moves as a mass in its centre."""
        s, mass = self.symbols, self.symbols.slot(segment, MASS)
        if not s.modal[segment]:
            return self.kinematics.centre(segment), mass, None
        length = s.slot(segment, LENGTH)
        return self.kinematics.point(segment, s.x), mass / length, length

    def _slopes(self, place: Place) -> list[tuple[sp.Expr, list[tuple[sp.Expr, sp.Expr]]]]:
        """Per phasor: angle at rest, and (real, imaginary) coefficient of each coordinate."""
        slopes = []
        for f in place:
            along, across = f.along.xreplace(self._at_rest), f.across.xreplace(self._at_rest)
            row = []
            for q in self.symbols.q:
                turn = sp.diff(f.angle, q)
                real = sp.diff(f.along, q).xreplace(self._at_rest) - turn * across
                imag = sp.diff(f.across, q).xreplace(self._at_rest) + turn * along
                row.append((sp.expand(real), sp.expand(imag)))
            slopes.append((f.angle.xreplace(self._at_rest), row))
        return slopes

    def _add_mass(
        self, terms: Terms, place: Place, weight: sp.Expr, length: sp.Expr | None
    ) -> None:
        slopes = self._slopes(place)
        n = len(self.symbols.q)
        for angle_a, row_a in slopes:
            for angle_b, row_b in slopes:
                between = sp.expand(angle_b - angle_a)
                for i in range(n):
                    for j in range(n):
                        self._add_product(
                            terms, (i, j), row_a[i], row_b[j], between, weight, length
                        )

    def _add_product(self, terms, where, a, b, between, weight, length) -> None:  # type: ignore[no-untyped-def]
        """Adds weight Re(conj(a) b exp(i between)), integrated over x where a length is given."""
        even = a[0] * b[0] + a[1] * b[1]
        odd = a[1] * b[0] - a[0] * b[1]
        for part, function in ((even, sp.cos), (odd, sp.sin)):
            if part == 0:
                continue
            value = self._integral(sp.expand(part), length)
            for slide, coefficient in self._split_slides(value):
                basis = function(between) * slide
                sign = 1
                if basis.could_extract_minus_sign():
                    basis, sign = -basis, -1
                if basis != 0:
                    terms[basis][where] += sign * weight * coefficient

    def _integral(self, polynomial: sp.Expr, length: sp.Expr | None) -> sp.Expr:
        """Exact integral of a polynomial in x from 0 to the length."""
        if length is None:
            return polynomial
        x = self.symbols.x
        terms = sp.Poly(polynomial, x).terms()
        return sp.Add(*[c * length ** (k[0] + 1) / (k[0] + 1) for k, c in terms])

    def _split_slides(self, value: sp.Expr) -> list[tuple[sp.Expr, sp.Expr]]:
        """(power product of the sliding joints' coordinates, the rest)."""
        slides = [q for q in self.symbols.theta if value.has(q)]
        if not slides:
            return [(sp.Integer(1), value)]
        terms = []
        for powers, coefficient in sp.Poly(sp.expand(value), *slides).terms():
            product = sp.Mul(*[q**p for q, p in zip(slides, powers, strict=True)])
            terms.append((product, coefficient))
        return terms

    @cached_property
    def gravity_stiffness(self) -> sp.Matrix:
        """(n, n) Hessian of the gravity potential at v = 0, from the phasors."""
        n = self.kinematics.structure.coordinates
        total = sp.zeros(n, n)
        s = self.symbols
        for k in range(self.kinematics.structure.segments):
            total -= self._pull_hessian(*self._spread(k))
            total -= self._pull_hessian(self.kinematics.segment_tip(k), s.slot(k, TIP_MASS), None)
        return total

    def _pull_hessian(self, place: Place, weight: sp.Expr, length: sp.Expr | None) -> sp.Matrix:
        """Second derivatives of weight g . p; g . exp(i phi)(a + i b) = a P + b Q."""
        g1, g2 = self.symbols.gravity
        q = self.symbols.q
        n = len(q)
        total = sp.zeros(n, n)
        for f in place:
            angle = f.angle.xreplace(self._at_rest)
            c, s = sp.cos(angle), sp.sin(angle)
            on_along, on_across = g1 * c + g2 * s, g2 * c - g1 * s
            turn = [sp.diff(f.angle, qi) for qi in q]
            w = (f.along, f.across)
            d = [[sp.diff(wi, qi).xreplace(self._at_rest) for qi in q] for wi in w]
            w0 = [wi.xreplace(self._at_rest) for wi in w]
            for i in range(n):
                for j in range(i, n):
                    d2 = [sp.diff(wi, q[i], q[j]).xreplace(self._at_rest) for wi in w]
                    tt = turn[i] * turn[j]
                    a = d2[0] - tt * w0[0] - turn[i] * d[1][j] - turn[j] * d[1][i]
                    b = d2[1] - tt * w0[1] + turn[i] * d[0][j] + turn[j] * d[0][i]
                    value = weight * (
                        on_along * self._integral(sp.expand(a), length)
                        + on_across * self._integral(sp.expand(b), length)
                    )
                    total[i, j] += value
                    if i != j:
                        total[j, i] += value
        return total


@cache
def straight_arm(structure: Structure) -> StraightArm:
    """Made once for a structure: its terms take a third of a second with three modes."""
    return StraightArm(Kinematics(structure))
