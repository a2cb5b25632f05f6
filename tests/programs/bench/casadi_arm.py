"""The non-linear arm as an expert writes it with CasADi: the same Rosenbrock step as C code.

CasADi's symbols go through the kinematics in the frame of each segment, with Gauss points along it;
gcc compiles the step, in which common sub-expressions are found once, with a loop over the samples.
Lengths and masses are numbers in the code; the length of a step and the bending stiffnesses stay
free. Forward sensitivities are CasADi's derivatives of the whole step. CVODES is CasADi's own, with
the same equations compiled.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.arm.slots import STIFFNESS, slot
from flexgui.core.model import Model
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.rosenbrock import COUPLINGS, GAMMA, NODE, WEIGHTS
from tests.programs.bench.peers import ABSOLUTE, gauss_order, held_stretches

FLAGS = (
    "-O3", "-march=native", "-fassociative-math", "-freciprocal-math", "-fno-signed-zeros",
    "-fno-trapping-math", "-fno-math-errno", "-ffinite-math-only",
)  # fmt: skip
"""Sums may be taken in any order, as in our compiled code. These are the parts of -ffast-math; that
itself would make the whole process round the smallest numbers to zero when the code is loaded."""

LOOP = """
void run(const double *start, const double *r, const double *theta, double *out, long samples,
         long substeps, long references) {{
  const double *arg[{arg}]; double *res[{res}], both[2][{length}], *y = both[0], *next = both[1];
  for (long i = 0; i < {length}; i++) y[i] = start[i];
  for (long k = 0; k < samples; k++) {{
    arg[0] = y; res[0] = out + k * {width};
    arm_outputs(arg, res, 0, 0, 0);
    for (long s = 0; s < substeps && k + 1 < samples; s++) {{
      arg[0] = y; arg[1] = r + k * references; arg[2] = theta; res[0] = next;
      arm_step(arg, res, 0, 0, 0);
      double *last = y; y = next; next = last;
    }}
  }}
}}
"""


def lacking() -> str:
    """What is missing, in plain words; empty where CasADi's code can be compiled."""
    if find_spec("casadi") is None:
        return "casadi is not installed (pip install '.[bench]')"
    return "" if shutil.which("gcc") else "there is no C compiler (gcc)"


@dataclass(frozen=True)
class Run:
    """A compiled loop; calling it gives the outputs (N, width) at the samples of a task."""

    function: Callable[..., None]
    length: int
    """Of the state, with the sensitivities where there are any."""
    width: int
    operations: int
    """Multiplications, additions and divisions of one step."""

    def __call__(self, task: Task, stiffness: np.ndarray, substeps: int) -> np.ndarray:
        """With the bending stiffnesses (segments,) in N m^2 and that many steps per sample."""
        start, out = np.zeros(self.length), np.empty((len(task.time), self.width))
        start[: len(task.start)] = task.start
        theta = np.array([task.sample_time / substeps, *stiffness])
        references = np.ascontiguousarray(task.references, dtype=float)
        places = [a.ctypes.data_as(ctypes.c_void_p) for a in (start, references, theta, out)]
        sizes = [ctypes.c_long(k) for k in (len(out), substeps, references.shape[1])]
        self.function(*places, *sizes)
        return out


@dataclass(frozen=True)
class CasadiArm:
    """Equations and step of a model with a static drive, in CasADi's SX."""

    model: Model

    @cached_property
    def symbols(self) -> tuple[Any, Any, Any]:
        """[q, q'] (2 n,), references r, theta = [step in s, EI of each segment]."""
        import casadi as ca

        arm, references = self.model.arm, self.model.numbers().law.references
        sizes = (2 * arm.coordinates, references, 1 + arm.joints)
        y, r, theta = (ca.SX.sym(name, k) for name, k in zip("yrt", sizes, strict=True))
        return y, r, theta

    @cached_property
    def _linear(self) -> tuple[Any, Any, Any]:
        """K (n, n), D (n, n) and R (n, nr) with the drive closed."""
        import casadi as ca

        n, joints = self.model.arm.coordinates, self.model.arm.joints
        p, law, *_ = self.model.numbers()

        def matrices(stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            with_these = p.copy()
            for k in range(joints):
                with_these[slot(k, STIFFNESS)] = stiffness[k]
            return self.model.compiled.linear_matrices(np.zeros(n), with_these)

        def sparse(a: np.ndarray) -> Any:
            return ca.sparsify(ca.DM(a))

        G, theta = np.eye(n, joints), self.symbols[2]
        K = sparse(G @ law.P)
        for k, one in enumerate(np.eye(joints)):
            K += theta[1 + k] * sparse(matrices(one)[0])
        return K, sparse(matrices(np.ones(joints))[1] + G @ law.V), sparse(G @ law.R)

    @cached_property
    def _tip(self) -> Any:
        """The tip (2,) in m at the symbols' q."""
        import casadi as ca

        arm, q = self.model.arm, self.symbols[0]
        place, angle = ca.SX(2, 1), 0.0
        for k, segment in enumerate(arm.segments):
            v = q[arm.modal_slice(k)]
            angle += q[k]
            columns, _, slope = _along(segment.length, v, v, 0.0)
            place += _turned(angle) @ ca.vertcat(columns[1, 0], -columns[0, 0])
            angle += slope @ v
        return place

    def inertia_and_force(self, q: Any, v: Any) -> tuple[Any, Any]:
        """M (n, n) and f (n,) without stiffness, damping and drive."""
        import casadi as ca

        arm, n = self.model.arm, self.model.arm.coordinates
        M, f = ca.SX(n, n), ca.SX(n, 1)
        root, bias, turning = ca.SX(2, n), ca.SX(2, 1), ca.SX(1, n)
        for k, segment in enumerate(arm.segments):
            turning[k] += 1.0
            own = arm.modal_slice(k)
            local = ca.vertcat(turning, ca.SX.eye(n)[own, :])
            points, weights = np.polynomial.legendre.leggauss(gauss_order(segment.modes))
            S, square, push, moment = 0.0, 0.0, 0.0, 0.0
            for x, weight in zip(points, segment.mass * weights / 2.0, strict=True):
                c, a, _ = _along(segment.length * (x + 1.0) / 2.0, q[own], v[own], turning @ v)
                S, square = S + weight * c, square + weight * (c.T @ c)
                push, moment = push + weight * a, moment + weight * (c.T @ a)
            mixed = root.T @ S @ local
            M += segment.mass * (root.T @ root) + local.T @ square @ local + mixed + mixed.T
            f -= root.T @ (segment.mass * bias + push) + local.T @ (S.T @ bias + moment)
            if k + 1 < len(arm.segments):
                c, a, slope = _along(segment.length, q[own], v[own], turning @ v)
                back = _turned(q[k + 1] + slope @ q[own]).T
                root, bias = back @ (root + c @ local), back @ (bias + a)
                turning = turning + slope @ local[1:, :]
        return M, f

    def right_side(self, q: Any, v: Any) -> tuple[Any, Any]:
        """M (n, n) and f (n,) with everything that acts."""
        K, D, R = self._linear
        M, f = self.inertia_and_force(q, v)
        return M, f - K @ q - D @ v + R @ self.symbols[1]

    @cached_property
    def step(self) -> Any:
        """[q, q'] after one step, as in core.simulate.rosenbrock."""
        import casadi as ca

        y, _, theta = self.symbols
        n, h = self.model.arm.coordinates, theta[0]
        K, D, _ = self._linear
        g, q, v = GAMMA * h, y[:n], y[n:]
        M, f = self.right_side(q, v)
        W = _factored(M + g * D + g * g * K)
        kv = _solved(W, f - g * (K @ v))
        kq = v + g * kv
        M2, f2 = self.right_side(q + NODE * h * kq, v + NODE * h * kv)
        rates = ca.vertcat(v + NODE * h * kv, _solved(_factored(M2), f2))
        stages = [ca.vertcat(kq, kv)]
        for known in COUPLINGS[1:]:
            d = rates + sum(c * k for c, k in zip(known, stages, strict=False))
            kv = _solved(W, M @ d[n:] - g * (K @ d[:n]))
            stages.append(ca.vertcat(d[:n] + g * kv, kv))
        return y + h * sum(m * k for m, k in zip(WEIGHTS, stages, strict=True))

    def states(self, folder: Path) -> Run:
        """Compiles the simulation; its outputs are [q, q'] (2 n,)."""
        y, r, theta = self.symbols
        return _compiled(folder, [y, r, theta], self.step, y)

    def slopes(self, folder: Path) -> Run:
        """Compiles the simulation with its forward sensitivities; its outputs are the tip (2,) and
        its slopes by each EI, one after the other."""
        import casadi as ca

        y, r, theta = self.symbols
        length, count = y.shape[0], theta.shape[0] - 1
        S = ca.SX.sym("S", length, count)
        seeds = ca.vertcat(S, ca.SX.eye(count))
        moved = ca.jtimes(self.step, ca.vertcat(y, theta[1:]), seeds)
        whole, slopes = ca.vertcat(y, ca.vec(S)), ca.jtimes(self._tip, y, S)
        after = ca.vertcat(self.step, ca.vec(moved))
        return _compiled(folder, [whole, r, theta], after, ca.vertcat(self._tip, ca.vec(slopes)))

    def cvodes(self, task: Task, stiffness: np.ndarray, rtol: float) -> Callable[[], np.ndarray]:
        """What gives the states (N, 2 n), restarted at every change of the references."""
        import casadi as ca

        y, r, theta = self.symbols
        n, stretches = self.model.arm.coordinates, held_stretches(task)
        M, f = self.right_side(y[:n], y[n:])
        ode = ca.cse(ca.vertcat(y[n:], _solved(_factored(M), f)))
        ode = ca.substitute(ode, theta[1:], ca.DM(stiffness))
        options = {
            "reltol": rtol, "abstol": rtol * ABSOLUTE, "max_num_steps": 10**6, "jit": True,
            "compiler": "shell", "jit_options": {"compiler": "gcc", "flags": list(FLAGS)},
        }  # fmt: skip
        lengths = {last - first for first, last in stretches}
        times = {k: [task.sample_time * (i + 1) for i in range(k)] for k in lengths}
        equations = {"x": y, "p": r, "ode": ode}
        run = {
            k: ca.integrator(f"hold{k}", "cvodes", equations, 0.0, times[k], options)
            for k in lengths
        }

        def states() -> np.ndarray:
            found = np.empty((len(task.time), 2 * n))
            found[0] = task.start
            for a, b in stretches:
                end = run[b - a](x0=found[a], p=task.references[a])["xf"]
                found[a + 1 : b + 1] = np.array(end).T
            return found

        return states


def _turned(angle: Any) -> Any:
    """(2, 2)"""
    import casadi as ca

    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, -s), ca.horzcat(s, c))


def _along(x: float, v: Any, dv: Any, rate: Any) -> tuple[Any, Any, Any]:
    """At x m along a segment with the modes v (m,), in the frame of its root: d place / d (angle,
    modes) (2, 1 + m), acceleration at constant rates (2,), d slope / d modes (1, m).

    Shapes x^a; the place is (x - v'B v / 2, sum x^a v) with B = a b / (a + b - 1) x^(a + b - 1).
    """
    import casadi as ca

    a = np.arange(v.shape[0]) + 2.0
    powers = a[:, None] + a - 1.0
    B, shape = ca.DM(np.outer(a, a) / powers * x**powers), ca.DM(x**a).T
    along, across, shortening = x - 0.5 * (v.T @ (B @ v)), shape @ v, -(B @ v).T
    columns = ca.vertcat(ca.horzcat(-across, shortening), ca.horzcat(along, shape))
    first = -(dv.T @ (B @ dv)) - rate**2 * along - 2.0 * rate * (shape @ dv)
    second = -(rate**2) * across + 2.0 * rate * (shortening @ dv)
    return columns, ca.vertcat(first, second), ca.DM(a * x ** (a - 1.0)).T


def _factored(A: Any) -> tuple[list[list[Any]], list[Any]]:
    """L and 1 / D of a symmetric A = L D L', written out."""
    L: list[list[Any]] = []
    inverse: list[Any] = []
    for i in range(A.shape[0]):
        left: list[Any] = []  # L D
        for j in range(i + 1):
            lower = L[j] if j < i else [c * d for c, d in zip(left, inverse, strict=True)]
            left.append(A[i, j] - sum(a * b for a, b in zip(left, lower, strict=False)))
        L.append(lower)
        inverse.append(1.0 / left[i])
    return L, inverse


def _solved(factors: tuple[list[list[Any]], list[Any]], b: Any) -> Any:
    """x of A x = b."""
    import casadi as ca

    L, inverse = factors
    x = [b[i] for i in range(len(L))]
    for i, row in enumerate(L):
        x[i] -= sum(a * c for a, c in zip(row, x[:i], strict=True))
    x = [a * d for a, d in zip(x, inverse, strict=True)]
    for i in reversed(range(len(x))):
        x[i] -= sum(L[j][i] * x[j] for j in range(i + 1, len(x)))
    return ca.vertcat(*x)


def _compiled(folder: Path, inputs: list[Any], after: Any, outputs: Any) -> Run:
    """`after` is the state after a step from the first of the inputs, the state."""
    import casadi as ca

    step = ca.Function("arm_step", inputs, [after], {"cse": True})
    seen = ca.Function("arm_outputs", inputs[:1], [outputs], {"cse": True})
    source, library = folder / "arm.c", folder / "arm.so"
    code = ca.CodeGenerator("arm.c")
    code.add(step)
    code.add(seen)
    length, width = inputs[0].shape[0], outputs.shape[0]
    sizes = {"arg": step.sz_arg(), "res": step.sz_res(), "length": length, "width": width}
    source.write_text(code.dump() + LOOP.format(**sizes), encoding="utf-8")
    how = ("-shared", "-fPIC", "-fno-semantic-interposition", "-lm")
    subprocess.run(["gcc", *FLAGS, str(source), *how, "-o", str(library)], check=True)
    counted = (ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST)
    kinds = [step.instruction_id(k) for k in range(step.n_instructions())]
    operations = sum(kind not in counted for kind in kinds)
    return Run(ctypes.CDLL(str(library)).run, length, width, operations)
