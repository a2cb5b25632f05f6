"""What a segment contributes to inertia and forces, from the moments of its mass.

A point of a segment stands at r = (x + u, delta) in the frame of the segment's root; foreshortening
u and deflection delta are polynomials in x, with coefficients in the segment's own modes v. With
the moments mu_k = int x^k dm every integral over the segment is a sum of products of coefficients,
so no place along it is visited (floating frame of reference, Shabana 2013, Dynamics of Multibody
Systems, 5.3-5.6).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import sympy as sp

from core.arm import shapes
from core.arm.printing import Statements
from core.arm.slots import LENGTH, MASS, TIP_MASS
from core.arm.symbols import Symbols

Polynomial = dict[int, sp.Expr]
"""Power of x -> coefficient that is not zero."""

Pair = tuple[sp.Expr, sp.Expr]
"""Along and across the segment at its root."""


@dataclass(frozen=True)
class Integrals:
    """Integrals over a segment's mass, the mass at its tip included, as names of values.

    r is the place in the frame of the root, r_j its derivative by mode j, r' and r'' its rate and
    its acceleration there (at constant rates of the modes, along only), e the plane's normal.
    """

    mass: sp.Expr
    place: Pair
    """int r"""
    rate: Pair
    """int r'"""
    acceleration: sp.Expr
    """int r'', along"""
    inertia: sp.Expr
    """int r . r"""
    inertia_rate: sp.Expr
    """int r . r'"""
    moment: sp.Expr
    """int (e x r) . r''"""
    modes: tuple[Pair, ...]
    """int r_j"""
    turning: tuple[sp.Expr, ...]
    """int (e x r) . r_j"""
    stretching: tuple[sp.Expr, ...]
    """int r_j . r"""
    coriolis: tuple[sp.Expr, ...]
    """int r_j . (e x r')"""
    bending: tuple[sp.Expr, ...]
    """int r_j . r''"""
    products: dict[tuple[int, int], sp.Expr]
    """(i, j), j <= i: int r_i . r_j"""


class Moments:
    """mu_k = int x^k dm of one segment and what is made of them."""

    def __init__(self, symbols: Symbols, segment: int, statements: Statements) -> None:
        self._let = statements.let
        self._mass, self._tip = symbols.slot(segment, MASS), symbols.slot(segment, TIP_MASS)
        self._length = symbols.slot(segment, LENGTH)
        self._powers: dict[int, sp.Expr] = {0: sp.Integer(1)}
        self._known: dict[int, sp.Expr] = {}

    def __call__(self, k: int) -> sp.Expr:
        """mu_k of a mass that is spread evenly and a point at the tip."""
        if k not in self._known:
            spread = self._mass * sp.Rational(1, k + 1) + self._tip
            self._known[k] = self._let(self._power(k) * spread)
        return self._known[k]

    def _power(self, k: int) -> sp.Expr:
        if k not in self._powers:
            self._powers[k] = self._let(self._power(k - 1) * self._length)
        return self._powers[k]

    def of(self, a: Polynomial) -> sp.Expr:
        """int a dm."""
        return sp.Add(*[c * self(k) for k, c in a.items()])

    def weighted(self, a: Polynomial, powers: Iterable[int]) -> Polynomial:
        """int a x^k dm of each power k."""
        return {
            k: self._let(sp.Add(*[c * self(k + j) for j, c in a.items()])) for k in sorted(powers)
        }


def times(a: Polynomial, weighted: Polynomial) -> sp.Expr:
    """int a b dm from `weighted` of b."""
    return sp.Add(*[c * weighted[k] for k, c in a.items()])


def segment_integrals(symbols: Symbols, segment: int, statements: Statements) -> Integrals:
    """Writes the statements that compute a segment's integrals."""
    let, mu = statements.let, Moments(symbols, segment, statements)
    v = symbols.modal[segment]
    rate = dict(zip(symbols.q, symbols.dq, strict=True))
    dv = [rate[one] for one in v]
    x = symbols.x

    def coefficients(e: sp.Expr) -> Polynomial:
        return {k: let(c) for (k,), c in sp.Poly(e, x).terms() if c != 0}

    def by_rates(e: sp.Expr) -> sp.Expr:
        return sp.Add(*[sp.diff(e, one) * d for one, d in zip(v, dv, strict=True)])

    along, across = x + shapes.foreshortening(v, x), shapes.deflection(v, x)
    a, y = coefficients(along), coefficients(across)
    da = [coefficients(sp.diff(along, one)) for one in v]
    dy = [coefficients(sp.diff(across, one)) for one in v]
    a1, y1 = coefficients(by_rates(along)), coefficients(by_rates(across))
    a2 = coefficients(by_rates(by_rates(along)))
    curved = {k for one in da for k in one}
    bent = {k for one in dy for k in one}
    on_a = mu.weighted(a, curved | bent | set(a))
    on_y, on_y1 = mu.weighted(y, curved | bent), mu.weighted(y1, curved)
    on_a1, on_a2 = mu.weighted(a1, bent), mu.weighted(a2, curved)
    on_da = [mu.weighted(one, curved) for one in da]
    stretching = tuple(let(times(f, on_a) + times(g, on_y)) for f, g in zip(da, dy, strict=True))
    return Integrals(
        mass=mu(0),
        place=(let(mu.of(a)), let(mu.of(y))),
        rate=(let(mu.of(a1)), let(mu.of(y1))),
        acceleration=let(mu.of(a2)),
        inertia=let(times(a, on_a) + times(y, on_y)),
        inertia_rate=let(sp.Add(*[d * g for d, g in zip(dv, stretching, strict=True)])),
        moment=let(-times(a2, on_y)),
        modes=tuple((let(mu.of(f)), let(mu.of(g))) for f, g in zip(da, dy, strict=True)),
        turning=tuple(let(times(g, on_a) - times(f, on_y)) for f, g in zip(da, dy, strict=True)),
        stretching=stretching,
        coriolis=tuple(let(times(g, on_a1) - times(f, on_y1)) for f, g in zip(da, dy, strict=True)),
        bending=tuple(let(times(f, on_a2)) for f in da),
        products={
            (i, j): let(times(da[i], on_da[j]) + mu.of(_product(dy[i], dy[j])))
            for i in range(len(v))
            for j in range(i + 1)
        },
    )


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    """Of two polynomials; of one term each here, as a shape is one power."""
    out: Polynomial = {}
    for i, c in a.items():
        for k, d in b.items():
            out[i + k] = out.get(i + k, sp.Integer(0)) + c * d
    return out
