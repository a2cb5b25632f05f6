"""Inertia and forces as sums over the segments, as statements of a generated module.

A coordinate that moves a segment's root moves a point of the segment by J_i + b_i e x r, with J_i
the root's Jacobian, b_i that of its direction and r the place in its frame; one of the segment's
own modes moves it by r_j. The squares of these, integrated over the mass, are M; their products
with the acceleration at constant rates are -F.

r = (x + u, delta): foreshortening u and deflection delta are polynomials in x, with coefficients in
the segment's own modes v. With the moments mu_k = int x^k dm every integral over the segment is a
sum of products of coefficients, so no place along it is visited (floating frame of reference,
Shabana 2013, Dynamics of Multibody Systems, 5.3-5.6).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import sympy as sp

from ..arm import shapes
from ..arm.kinematics import Kinematics, components
from ..arm.printing import Statements, code
from ..arm.slots import CENTRE_ACROSS, CENTRE_ALONG, LENGTH, MASS, TIP_MASS
from ..arm.symbols import Symbols

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


def rigid_integrals(symbols: Symbols, segment: int, statements: Statements) -> Integrals:
    """Write the statements of a rigid segment's integrals: a mass in its centre and one at its
    tip. The inertia about the centre is among the constants of M."""
    let, zero = statements.let, sp.Integer(0)
    mass, tip, length, along, across = (
        symbols.slot(segment, which)
        for which in (MASS, TIP_MASS, LENGTH, CENTRE_ALONG, CENTRE_ACROSS)
    )
    first, second = let(mass * along), let(mass * across)
    return Integrals(
        mass=let(mass + tip),
        place=(let(first + tip * length), second),
        rate=(zero, zero),
        acceleration=zero,
        inertia=let(first * along + second * across + tip * length**2),
        inertia_rate=zero,
        moment=zero,
        modes=(), turning=(), stretching=(), coriolis=(), bending=(), products={},
    )  # fmt: skip


def segment_integrals(symbols: Symbols, segment: int, statements: Statements) -> Integrals:
    """Write the statements that compute a bending segment's integrals."""
    let, mu = statements.let, Moments(symbols, segment, statements)
    v = symbols.modal[segment]
    rate = dict(zip(symbols.q, symbols.dq, strict=True))
    dv = [rate[amplitude] for amplitude in v]
    x = symbols.x

    def coefficients(e: sp.Expr) -> Polynomial:
        return {k: let(c) for (k,), c in sp.Poly(e, x).terms() if c != 0}

    def by_rates(e: sp.Expr) -> sp.Expr:
        return sp.Add(*[sp.diff(e, amplitude) * d for amplitude, d in zip(v, dv, strict=True)])

    along, across = x + shapes.foreshortening(v, x), shapes.deflection(v, x)
    a, y = coefficients(along), coefficients(across)
    da = [coefficients(sp.diff(along, amplitude)) for amplitude in v]
    dy = [coefficients(sp.diff(across, amplitude)) for amplitude in v]
    a1, y1 = coefficients(by_rates(along)), coefficients(by_rates(across))
    a2 = coefficients(by_rates(by_rates(along)))
    curved = {k for amplitude in da for k in amplitude}
    bent = {k for amplitude in dy for k in amplitude}
    on_a = mu.weighted(a, curved | bent | set(a))
    on_y, on_y1 = mu.weighted(y, curved | bent), mu.weighted(y1, curved)
    on_a1, on_a2 = mu.weighted(a1, bent), mu.weighted(a2, curved)
    on_da = [mu.weighted(amplitude, curved) for amplitude in da]
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


class Sums:
    """Adds up M (lower part) and f over the segments: statements of their entries."""

    def __init__(self, n: int) -> None:
        self.lines: list[str] = []
        self._n = n
        self._begun: set[str] = set()

    def add(self, target: str, value: sp.Expr) -> None:
        """target += value; the first value of an entry is the entry."""
        value = sp.sympify(value, strict=True)  # a text would be evaluated
        if value == 0:
            return
        sign = "+=" if target in self._begun else "="
        self._begun.add(target)
        self.lines.append(f"{target} {sign} {code(value)}")

    def mass(self, i: int, j: int, value: sp.Expr) -> None:
        """M_ij and M_ji."""
        self.add(f"M[{max(i, j)}, {min(i, j)}]", value)

    def force(self, i: int, value: sp.Expr) -> None:
        """f_i."""
        self.add(f"f[{i}]", value)

    def whole(self) -> list[str]:
        """All statements; what got no value is zero, the upper part of M mirrors the lower."""
        lower = [(i, j) for i in range(self._n) for j in range(i + 1)]
        names = [*(f"M[{i}, {j}]" for i, j in lower), *(f"f[{i}]" for i in range(self._n))]
        zeros = [f"{name} = 0.0" for name in names if name not in self._begun]
        mirror = [f"M[{j}, {i}] = M[{i}, {j}]" for i, j in lower if i != j]
        return [*self.lines, *zeros, *mirror]


def add_segment(kinematics: Kinematics, segment: int, sums: Sums) -> None:
    """Add what one segment and the mass at its tip contribute."""
    s = kinematics.symbols
    statements = Statements(f"s{segment + 1}_", sums.lines)
    root = _Root.of(kinematics, segment, statements)
    integrals = segment_integrals if s.modal[segment] else rigid_integrals
    own = integrals(s, segment, statements)
    modes = [s.q.index(v) for v in s.modal[segment]]
    _add_root(root, own, sums, statements)
    _add_modes(root, own, modes, sums, statements)


@dataclass(frozen=True)
class _Root:
    """How a segment's root moves, as names of values."""

    jacobian: tuple[Pair, ...]
    """By each coordinate, in the plane."""
    angle: tuple[sp.Expr, ...]
    """Of its direction by each coordinate."""
    acceleration: Pair
    """At constant rates of all coordinates, without gravity's."""
    speed: sp.Expr
    """Of its direction, rad/s."""
    direction: Pair
    """Cosine and sine."""

    @classmethod
    def of(cls, kinematics: Kinematics, segment: int, statements: Statements) -> _Root:
        """Write the statements that compute it."""
        s = kinematics.symbols
        place, angle = kinematics.root(segment)
        jacobian = components(place).jacobian(s.q)
        dq = sp.Matrix(s.dq)
        acceleration = (jacobian * dq).jacobian(s.q) * dq - sp.Matrix(s.gravity)
        slopes = [sp.diff(angle, q) for q in s.q]
        speed = sp.Add(*[b * d for b, d in zip(slopes, s.dq, strict=True)])
        outputs = [*jacobian, *acceleration, speed, sp.cos(angle), sp.sin(angle)]
        names, n = statements.shared(outputs), len(s.q)
        columns = tuple((names[i], names[n + i]) for i in range(n))
        ax, ay, speed, c, s_ = names[2 * n :]
        return cls(columns, tuple(slopes), (ax, ay), speed, (c, s_))

    def turned(self, pair: Pair) -> Pair:
        """A vector of the root's frame, in the plane."""
        (c, s), (a, b) = self.direction, pair
        return c * a - s * b, s * a + c * b


def _dot(a: Pair, b: Pair) -> sp.Expr:
    return a[0] * b[0] + a[1] * b[1]


def _add_root(root: _Root, own: Integrals, sums: Sums, statements: Statements) -> None:
    """What the coordinates that move the root feel."""
    let, w = statements.let, root.speed
    (sx, sy), (dx, dy) = own.place, own.rate
    turn = tuple(let(e) for e in root.turned((-sy, sx)))  # int e x r, in the plane
    moving = root.turned((own.acceleration - w**2 * sx - 2 * w * dy, 2 * w * dx - w**2 * sy))
    total = tuple(let(own.mass * a + b) for a, b in zip(root.acceleration, moving, strict=True))
    turning = let(_dot(turn, root.acceleration) + 2 * w * own.inertia_rate + own.moment)
    for i, (J, b) in enumerate(zip(root.jacobian, root.angle, strict=True)):
        if J == (0, 0) and b == 0:
            continue
        sums.force(i, -_dot(J, total) - b * turning)
        pushed = tuple(let(own.mass * J[k] + b * turn[k]) for k in range(2))
        turned = let(_dot(J, turn) + b * own.inertia)
        for j in range(i + 1):
            sums.mass(i, j, _dot(root.jacobian[j], pushed) + root.angle[j] * turned)


def _add_modes(
    root: _Root, own: Integrals, modes: Sequence[int], sums: Sums, statements: Statements
) -> None:
    """What the segment's own modes feel."""
    w = root.speed
    for k, i in enumerate(modes):
        moved = tuple(statements.let(e) for e in root.turned(own.modes[k]))
        carried = _dot(moved, root.acceleration) - w**2 * own.stretching[k]
        sums.force(i, -(carried + 2 * w * own.coriolis[k] + own.bending[k]))
        for j, (J, b) in enumerate(zip(root.jacobian, root.angle, strict=True)):
            sums.mass(i, j, _dot(J, moved) + b * own.turning[k])
        for m, j in enumerate(modes[: k + 1]):
            sums.mass(i, j, own.products[k, m])
