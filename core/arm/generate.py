"""From the symbolic statement of an arm to the text of a Python module that Numba compiles.

M and F are sums over the segments (core.arm.assembly); K and D of the straight arm and the tip's
place and Jacobian are written as SymPy gives them.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from .. import __name__ as core
from ..arm.assembly import Sums, add_segment
from ..arm.energies import damping_matrix, lumped_inertia, stiffness_matrix
from ..arm.kinematics import Kinematics, components
from ..arm.printing import Statements, code, free_symbols, written_out
from ..arm.solvers import solver_functions
from ..arm.straight import StraightArm

_HEAD = '''"""Equations of {whose}, written by {core}.arm.generate from their symbolic statement."""

from numba import cfunc, types

from {core}.arm.instructions import straight_line
{functions}

numbers = types.float64[{layout}]
OPTIONS = {{"cache": True, "nopython": True, "error_model": "numpy"}}
statements = straight_line({columns}, lanes={wide}, fast={fast})
'''


def module_head(n: int, wide: bool) -> str:
    """What stands before the functions in the module of every arm of n coordinates."""
    if wide:
        return _HEAD.format(
            whose="LANES arms side by side", columns=n, wide=wide, fast=("contract",),
            core=core, layout=":, ::1",
            functions=f"from {core}.lanes.functions import absolute, cos, maximum, sin",
        )  # fmt: skip
    # Sums may be taken in any order, which lets them be taken side by side.
    return _HEAD.format(
        whose="one arm", columns=n, wide=wide, fast=("contract", "reassoc", "nsz"),
        core=core, functions="from math import cos, sin", layout="::1",
    )  # fmt: skip


def _load(symbols: Sequence[sp.Symbol], array: str, used: set[sp.Basic]) -> list[str]:
    return [f"{s} = {array}[{i}]" for i, s in enumerate(symbols) if s in used]


def _entries(target: str, matrix: sp.Matrix) -> list[str]:
    """One statement per entry of a matrix."""
    rows, columns = matrix.shape
    return [
        f"{target}[{i}, {j}] = {code(matrix[i, j])}" for i in range(rows) for j in range(columns)
    ]


class ArmCode:
    """The module's functions as text, for one structure."""

    def __init__(self, kinematics: Kinematics) -> None:
        self.kinematics = kinematics
        self.symbols = kinematics.symbols
        self.n = kinematics.structure.coordinates

    def module(self, wide: bool = False) -> str:
        """The text of the module that is compiled: for one arm or, `wide`, for LANES side by side
        (core.lanes), which also has the linear algebra of a step and no linear model."""
        functions = [
            written_out("dynamics", "q, v, p, M, f", self.dynamics()),
            written_out("tip", "q, p, z, J", self.tip()),
        ]
        if wide:
            functions += solver_functions(self.n)
        else:
            functions.append(written_out("linear", "q, p, K, D", self.linear()))
        return module_head(self.n, wide) + "".join(functions)

    def dynamics(self) -> list[str]:
        """M(q) and F(q, q') without the drive: M q'' = F + G u."""
        s = self.symbols
        constant = lumped_inertia(self.kinematics)
        stiffness, damping = stiffness_matrix(self.kinematics), damping_matrix(self.kinematics)
        force = -stiffness * sp.Matrix(s.q) - damping * sp.Matrix(s.dq)
        sums = Sums(self.n)
        for i in range(self.n):
            sums.force(i, force[i])
            for j in range(i + 1):
                sums.mass(i, j, constant[i, j])
        for k in range(self.kinematics.structure.segments):
            add_segment(self.kinematics, k, sums)
        loads = _load(s.q, "q", set(s.q)) + _load(s.dq, "v", set(s.dq))
        return loads + _load(s.p, "p", set(s.p)) + sums.whole()

    def tip(self) -> list[str]:
        """z and dz/dq at any q."""
        s = self.symbols
        place = components(self.kinematics.tip())
        jacobian = place.jacobian(s.q)
        statements = Statements("t")
        outputs = [*place, *jacobian]
        reduced = statements.shared(outputs)
        used = free_symbols(outputs)
        lines = _load(s.q, "q", used) + _load(s.p, "p", used) + statements.lines
        lines += [f"z[{i}] = {code(reduced[i])}" for i in range(2)]
        slopes = sp.Matrix(2, self.n, reduced[2:])
        return lines + _entries("J", slopes)

    def linear(self) -> list[str]:
        """K = -dF/dq and D = -dF/dq' at v = 0, q' = 0."""
        s = self.symbols
        gravity = StraightArm(self.kinematics).gravity_stiffness
        stiffness = stiffness_matrix(self.kinematics) + gravity
        damping = damping_matrix(self.kinematics)
        statements = Statements("c")
        outputs = [*stiffness, *damping]
        reduced, used = statements.shared(outputs), free_symbols(outputs)
        lines = _load(s.q, "q", used) + _load(s.p, "p", used) + statements.lines
        size = self.n * self.n
        lines += _entries("K", sp.Matrix(self.n, self.n, reduced[:size]))
        return lines + _entries("D", sp.Matrix(self.n, self.n, reduced[size:]))
