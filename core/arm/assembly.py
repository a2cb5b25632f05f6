"""Inertia and forces as sums over the segments, as statements of a generated module.

A coordinate that moves a segment's root moves a point of the segment by J_i + b_i e x r, with J_i
the root's Jacobian, b_i that of its direction and r the place in its frame; one of the segment's
own modes moves it by r_j. The squares of these, integrated over the mass, are M; their products
with the acceleration at constant rates are -F.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from core.arm.kinematics import Kinematics, components
from core.arm.moments import Integrals, Pair, segment_integrals
from core.arm.printing import Statements, code


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
    """Adds what one segment and the mass at its tip contribute."""
    s = kinematics.symbols
    statements = Statements(f"s{segment + 1}_", sums.lines)
    root = _Root.of(kinematics, segment, statements)
    own = segment_integrals(s, segment, statements)
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
        """Writes the statements that compute it."""
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
