"""From the symbolic statement of an arm to the text of a Python module that Numba compiles.

Inertia and Coriolis forces are not expanded: the module evaluates the Jacobian J = dp/dq and
the bias acceleration a = (dJ/dt) q' at Gauss points and sums mass J'J and mass J'a, which is
exact because the shapes are polynomials. Sub-expressions that do not depend on the place x
along a segment are computed once per segment.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files

import numpy as np
import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from core.arm.energies import damping_matrix, lumped_inertia, stiffness_matrix
from core.arm.kinematics import Kinematics, components
from core.arm.shapes import gauss_order
from core.arm.slots import LENGTH, MASS, TIP_MASS
from core.arm.straight import StraightArm
from core.arm.widen import widened

INDENT = "    "
MIRROR = ["for i in range(f.size):", "    for j in range(i):", "        M[j, i] = M[i, j]"]


class _Printer(PythonCodePrinter):
    """Plain arithmetic; small powers as products, which Numba compiles best."""

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False, "allow_unknown_functions": False})

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:  # noqa: N802
        base, power = expr.as_base_exp()
        if power.is_Integer and 2 <= int(power) <= 16:
            factor = self.parenthesize(base, 100)
            return "(" + "*".join([factor] * int(power)) + ")"
        return str(super()._print_Pow(expr, rational=rational))

    def _print_Rational(self, expr: sp.Rational) -> str:  # noqa: N802
        return f"({expr.p}/{expr.q})"


def _code(expression: sp.Expr) -> str:
    return str(_Printer().doprint(expression))


def _load(symbols: Sequence[sp.Symbol], array: str, used: set[sp.Basic]) -> list[str]:
    return [f"{s} = {array}[{i}]" for i, s in enumerate(symbols) if s in used]


def _entries(target: str, matrix: sp.Matrix, operator: str) -> list[str]:
    """One statement per non-zero entry of a matrix."""
    rows, columns = matrix.shape
    return [
        f"{target}[{i}, {j}] {operator} {_code(matrix[i, j])}"
        for i in range(rows)
        for j in range(columns)
        if matrix[i, j] != 0
    ]


def _shared(
    outputs: Sequence[sp.Expr], prefix: str
) -> tuple[list[tuple[sp.Symbol, sp.Expr]], list[sp.Expr]]:
    names = (sp.Symbol(f"{prefix}{i}") for i in range(10**6))
    found, reduced = sp.cse(list(outputs), symbols=names, optimizations=None)
    return found, reduced


def _free(expressions: Sequence[sp.Expr]) -> set[sp.Basic]:
    return set().union(*[e.free_symbols for e in expressions]) if expressions else set()


def _table(name: str, values: Sequence[float]) -> str:
    return f"{name} = np.array([{', '.join(repr(float(v)) for v in values)}])"


class ArmCode:
    """The module's functions as text, for one structure."""

    def __init__(self, kinematics: Kinematics) -> None:
        self.kinematics = kinematics
        self.symbols = kinematics.symbols
        self.n = kinematics.structure.coordinates

    def module(self) -> str:
        """The text of the module that is compiled."""
        template = files("core.arm").joinpath("module_template.txt").read_text(encoding="utf-8")
        return (
            template.replace("@TABLES@", self._gauss_tables())
            .replace("@DYNAMICS@", self._block(self.dynamics()))
            .replace("@TIP@", self._block(self.tip()))
            .replace("@LINEAR@", self._block(self.linear()))
        )

    def wide_module(self) -> str:
        """The same functions for LANES arms side by side (core.lanes)."""
        template = files("core.arm").joinpath("wide_module_template.txt")
        return (
            template.read_text(encoding="utf-8")
            .replace("@TABLES@", self._gauss_tables())
            .replace("@DYNAMICS@", self._block(widened(self.dynamics(), self.n)))
            .replace("@TIP@", self._block(widened(self.tip(), self.n)))
        )

    @staticmethod
    def _block(lines: list[str]) -> str:
        return "\n".join(INDENT + line for line in lines)

    def _gauss_tables(self) -> str:
        """Places and weights along each segment; the last entry is the mass at the tip."""
        tables = []
        for k, modes in enumerate(self.kinematics.structure.modes, start=1):
            at, w = np.polynomial.legendre.leggauss(gauss_order(modes))
            tables += [
                _table(f"NODES_{k}", [*(at + 1.0) / 2.0, 1.0]),
                _table(f"WEIGHTS_{k}", [*w / 2.0, 0.0]),
                _table(f"TIPS_{k}", [*np.zeros(len(w)), 1.0]),
            ]
        return "\n".join(tables)

    def dynamics(self) -> list[str]:
        """M(q) and F(q, q') without the drive: M q'' = F + G u."""
        s = self.symbols
        lines = ["M[:, :] = 0.0", "f[:] = 0.0"]
        constant = sp.Matrix(np.tril(lumped_inertia(self.kinematics)))
        stiffness, damping = stiffness_matrix(self.kinematics), damping_matrix(self.kinematics)
        force = -stiffness * sp.Matrix(s.q) - damping * sp.Matrix(s.dq)
        body: list[str] = _entries("M", constant, "+=")
        body += [f"f[{i}] += {_code(e)}" for i, e in enumerate(force) if e != 0]
        for k in range(self.kinematics.structure.segments):
            body += self._segment(k)
        loads = _load(s.q, "q", set(s.q)) + _load(s.dq, "v", set(s.dq))
        return loads + _load(s.p, "p", set(s.p)) + lines + body + MIRROR

    def _segment(self, k: int) -> list[str]:
        """The sum over one segment's Gauss points and its tip mass.

        Sums stand in local variables and no branch is in the loop, so that the compiler takes
        several points per instruction.
        """
        s = self.symbols
        place = components(self.kinematics.point(k, s.x))
        jacobian = place.jacobian(s.q)
        velocity = jacobian * sp.Matrix(s.dq)
        bias = velocity.jacobian(s.q) * sp.Matrix(s.dq)
        active = [i for i in range(self.n) if jacobian[0, i] != 0 or jacobian[1, i] != 0]
        outputs = [jacobian[r, i] for i in active for r in (0, 1)] + list(bias)
        shared, reduced = _shared(outputs, f"s{k + 1}_")
        varying: set[sp.Basic] = {s.x}
        once: list[str] = []
        every: list[str] = []
        for name, expression in shared:
            moves = bool(expression.free_symbols & varying)
            if moves:
                varying.add(name)
            (every if moves else once).append(f"{name} = {_code(expression)}")
        inner = every + self._accumulate(active, reduced)
        mass, length = s.slot(k, MASS), s.slot(k, LENGTH)
        loop = [
            f"for k in range(NODES_{k + 1}.size):",
            f"{INDENT}x = {length} * NODES_{k + 1}[k]",
            f"{INDENT}w = {mass} * WEIGHTS_{k + 1}[k] + {s.slot(k, TIP_MASS)} * TIPS_{k + 1}[k]",
        ]
        sums = [(f"f_{i}", f"f[{i}]") for i in active]
        sums += [(f"M_{i}_{j}", f"M[{i}, {j}]") for i in active for j in active if j <= i]
        zeros = [f"{name} = 0.0" for name, _ in sums]
        added = [f"{target} += {name}" for name, target in sums]
        return once + zeros + loop + [INDENT + line for line in inner] + added

    def _accumulate(self, active: list[int], reduced: list[sp.Expr]) -> list[str]:
        g1, g2 = self.symbols.gravity
        lines = [f"ax = {_code(reduced[-2])} - {g1}", f"ay = {_code(reduced[-1])} - {g2}"]
        for place, i in enumerate(active):
            lines.append(f"jx{i} = {_code(reduced[2 * place])}")
            lines.append(f"jy{i} = {_code(reduced[2 * place + 1])}")
        for i in active:
            lines.append(f"wx = w * jx{i}")
            lines.append(f"wy = w * jy{i}")
            lines.append(f"f_{i} -= wx * ax + wy * ay")
            for j in active:
                if j <= i:
                    lines.append(f"M_{i}_{j} += wx * jx{j} + wy * jy{j}")
        return lines

    def tip(self) -> list[str]:
        """z and dz/dq at any q."""
        s = self.symbols
        place = components(self.kinematics.tip())
        jacobian = place.jacobian(s.q)
        shared, reduced = _shared([*place, *jacobian], "t")
        used = _free([e for _, e in shared] + reduced)
        lines = _load(s.q, "q", used) + _load(s.p, "p", used)
        lines += [f"{name} = {_code(e)}" for name, e in shared]
        lines += [f"z[{i}] = {_code(reduced[i])}" for i in range(2)]
        slopes = sp.Matrix(2, self.n, reduced[2:])
        return [*lines, "J[:, :] = 0.0", *_entries("J", slopes, "=")]

    def linear(self) -> list[str]:
        """K = -dF/dq and D = -dF/dq' at v = 0, q' = 0."""
        s = self.symbols
        straight = StraightArm(self.kinematics)
        stiffness = straight.bending + straight.gravity_stiffness
        damping = straight.damping
        shared, reduced = _shared([*stiffness, *damping], "c")
        used = _free([e for _, e in shared] + reduced)
        lines = _load(s.q, "q", used) + _load(s.p, "p", used)
        lines += [f"{name} = {_code(e)}" for name, e in shared]
        size = self.n * self.n
        lines += ["K[:, :] = 0.0", "D[:, :] = 0.0"]
        lines += _entries("K", sp.Matrix(self.n, self.n, reduced[:size]), "=")
        return lines + _entries("D", sp.Matrix(self.n, self.n, reduced[size:]), "=")
