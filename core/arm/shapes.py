"""Assumed modes of a beam: deflection, slope, axial foreshortening, bending energy."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp


def exponent(mode: int) -> int:
    """Mode i (from 0) has the shape x^(i+2): clamped at x = 0 in place and slope."""
    return mode + 2


def deflection(v: Sequence[sp.Symbol], x: sp.Expr) -> sp.Expr:
    """delta(x) = sum_i x^(i+2) v_i."""
    return sp.Add(*[vi * x ** exponent(i) for i, vi in enumerate(v)])


def slope(v: Sequence[sp.Symbol], x: sp.Expr) -> sp.Expr:
    """delta'(x)."""
    return sp.Add(*[exponent(i) * vi * x ** (exponent(i) - 1) for i, vi in enumerate(v)])


def curvature(v: Sequence[sp.Symbol], x: sp.Expr) -> sp.Expr:
    """delta''(x)."""
    powers = [exponent(i) for i in range(len(v))]
    terms = zip(powers, v, strict=True)
    return sp.Add(*[a * (a - 1) * vi * x ** (a - 2) for a, vi in terms])


def foreshortening(v: Sequence[sp.Symbol], x: sp.Expr) -> sp.Expr:
    """u(x) = -1/2 int_0^x delta'^2, to second order (-2/3 x^3 v^2 for one mode)."""
    terms = []
    for i, vi in enumerate(v):
        for j, vj in enumerate(v):
            a, b = exponent(i), exponent(j)
            terms.append(vi * vj * sp.Rational(a * b, 2 * (a + b - 1)) * x ** (a + b - 1))
    return -sp.Add(*terms)


def bending_energy(v: Sequence[sp.Symbol], length: sp.Expr, stiffness: sp.Expr) -> sp.Expr:
    """1/2 EI int_0^l delta''^2 (2 EI l v^2 for one mode)."""
    terms = []
    for i, vi in enumerate(v):
        for j, vj in enumerate(v):
            a, b = exponent(i), exponent(j)
            factor = sp.Rational(a * (a - 1) * b * (b - 1), a + b - 3)
            terms.append(vi * vj * factor * length ** (a + b - 3))
    return stiffness / 2 * sp.Add(*terms)
