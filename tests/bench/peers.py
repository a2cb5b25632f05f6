"""What the comparisons are held against: the cost and the non-linear arm as one writes them.

The cost (13): state-space matrices, a library's response, squared errors. The arm: SymPy equations,
lambdify, scipy's solve_ivp, as the fair peer: numbers put in, nothing expanded, M and f summed over
Gauss points in symbols, common sub-expressions found once (cse), plain floats through `math` (six
times quicker here than NumPy arrays over the Gauss points), M q'' = f solved by numpy.linalg.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
import sympy as sp

from flexgui.core.arm.energies import damping_matrix, lumped_inertia, stiffness_matrix
from flexgui.core.arm.kinematics import Kinematics, components
from flexgui.core.arm.slots import LENGTH, MASS
from flexgui.core.identify.prepared_recording import Prepared
from flexgui.core.model import Model
from flexgui.core.simulate.motion import Task
from tests.bench.case import NAMES, Case

ABSOLUTE = 1e-3
"""Absolute over relative tolerance: the bending is a thousandth of its rates."""


@dataclass(frozen=True)
class SympyArm:
    """x' of x = [q, q'] for a model with a static drive."""

    model: Model

    def __post_init__(self) -> None:
        _ = self._evaluate  # derived now, so that no run pays for it

    @cached_property
    def p(self) -> np.ndarray:
        """The arm's numbers."""
        return self.model.numbers().p

    @cached_property
    def _evaluate(self) -> Callable[..., list[float]]:
        """The lower triangle of M row by row, then f without the drive."""
        kinematics = Kinematics(self.model.compiled.structure)
        s, n = kinematics.symbols, self.model.arm.coordinates
        values = dict(zip(s.p, self.p.tolist(), strict=True))
        M = sp.Matrix(lumped_inertia(kinematics)).subs(values)
        f = -stiffness_matrix(kinematics).subs(values) * sp.Matrix(s.q)
        f -= damping_matrix(kinematics).subs(values) * sp.Matrix(s.dq)
        for k in range(kinematics.structure.segments):
            inertia, force = _segment(kinematics, k, values)
            M, f = M + inertia, f + force
        outputs = [M[i, j] for i in range(n) for j in range(i + 1)] + list(f)
        return sp.lambdify([*s.q, *s.dq], outputs, modules="math", cse=True)

    @cached_property
    def _places(self) -> np.ndarray:
        """(n, n): where each entry of M stands in the outputs."""
        n = self.model.arm.coordinates
        return np.array([[max(i, j) * (max(i, j) + 1) // 2 + min(i, j) for j in range(n)]
                         for i in range(n)])  # fmt: skip

    @cached_property
    def _drive(self) -> tuple[np.ndarray, np.ndarray]:
        """u = R r - F x."""
        law = self.model.numbers().law
        return law.R, np.hstack([law.P, law.V])

    def mass_and_force(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """M (n, n) and f (n,) without the drive."""
        values = np.array(self._evaluate(*x.tolist()))
        return values[self._places], values[-self._places.shape[0] :]

    def rate(self, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        """x' with the references r."""
        R, feedback = self._drive
        M, f = self.mass_and_force(x)
        f[: len(R)] += R @ r - feedback @ x
        return np.concatenate([x[len(f) :], np.linalg.solve(M, f)])


def gauss_order(modes: int) -> int:
    """Gauss points that integrate |dp/dq|^2 along a segment exactly.

    The highest power of x in p is that of the foreshortening, 2 modes + 1 (1 for a rigid
    segment), so the integrand has degree at most 2 (2 modes + 1).
    """
    return 2 * modes + 2


def _segment(
    kinematics: Kinematics, k: int, values: dict[sp.Symbol, float]
) -> tuple[sp.Matrix, sp.Matrix]:
    """sum mass J'J and -sum mass J'a over one segment's Gauss points."""
    s = kinematics.symbols
    place = components(kinematics.point(k, s.x)).subs(values)
    J = place.jacobian(s.q)
    bias = (J * sp.Matrix(s.dq)).jacobian(s.q) * sp.Matrix(s.dq)
    length, mass = values[s.slot(k, LENGTH)], values[s.slot(k, MASS)]
    M, f = sp.zeros(len(s.q), len(s.q)), sp.zeros(len(s.q), 1)
    at, weights = np.polynomial.legendre.leggauss(gauss_order(kinematics.structure.modes[k]))
    for x, w in zip(at.tolist(), weights.tolist(), strict=True):
        there = {s.x: length * (x + 1.0) / 2.0}
        slopes = J.subs(there)
        M += mass * w / 2.0 * (slopes.T * slopes)
        f -= mass * w / 2.0 * (slopes.T * bias.subs(there))
    return M, f


@dataclass(frozen=True)
class Setting:
    """How solve_ivp is called."""

    method: str
    rtol: float
    restart: bool
    """At every change of the input; else one run whose steps are no longer than a hold."""

    def __str__(self) -> str:
        how = "restarted at every change of the input" if self.restart else "max_step = hold"
        return f"{self.method}, rtol {self.rtol:.0e}, {how}"


def held_stretches(task: Task) -> list[tuple[int, int]]:
    """(first, last) sample of each stretch of constant references."""
    changed = np.any(np.diff(task.references, axis=0) != 0.0, axis=1)
    edges = [0, *(np.flatnonzero(changed) + 1).tolist(), len(task.time) - 1]
    return [(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True) if a < b]


def integrate(arm: SympyArm, task: Task, setting: Setting) -> np.ndarray:
    """States (N, 2 n) at the samples; not a number after a failure."""
    states = np.full((len(task.time), len(task.start)), np.nan)
    states[0] = task.start
    options = {"method": setting.method, "rtol": setting.rtol, "atol": setting.rtol * ABSOLUTE}
    stretches = held_stretches(task)
    if not setting.restart:
        hold = float(min(task.time[b] - task.time[a] for a, b in stretches))
        options["max_step"] = hold
        stretches = [(0, len(task.time) - 1)]

    def rate(t: float, x: np.ndarray, first: int, last: int) -> np.ndarray:
        """The input of the sample that t lies in; what holds at `last` begins after it."""
        k = min(int(t / task.sample_time + 1e-9), last - 1)
        return arm.rate(x, task.references[max(k, first)])

    for a, b in stretches:
        t = task.time[a : b + 1]
        found = scipy.integrate.solve_ivp(
            rate, (t[0], t[-1]), states[a], t_eval=t, args=(a, b), **options
        )
        if not found.success:
            break
        states[a : b + 1] = found.y.T
    return states


Response = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, Prepared], np.ndarray]
"""y (N, 2) from A, B, C, D and what one experiment did."""


Matrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def state_space(case: Case, e: Prepared, vector: np.ndarray) -> Matrices:
    """A, B, C, D of all eight states with the loop closed, from E x' = A x + B r, (11)."""
    model, n = case.model, case.model.arm.coordinates
    p, law, *_ = model.numbers(dict(zip(NAMES, vector.tolist(), strict=True)))
    q = e.task.schedule[0]
    M = model.compiled.mass_matrix(q, p)
    K, D = model.compiled.linear_matrices(q, p)
    G = np.eye(n, model.arm.joints)
    A = np.vstack([np.eye(n, 2 * n, k=n), np.linalg.solve(M, -np.hstack([K, D + G @ law.V]))])
    B = np.vstack([np.zeros((n, law.references)), np.linalg.solve(M, G @ law.R)])
    rows = e.outputs[0].rows(model.arm, p, law)
    assert rows is not None
    return A, B, np.hstack([rows.Q, rows.V]), rows.R


def peer_cost(case: Case, response: Response, vector: np.ndarray) -> float:
    """Sum of squared errors over all recordings."""
    total = 0.0
    for e in case.experiments:
        error = response(*state_space(case, e, vector), e) - e.measured
        total += float(np.sum(error**2))
    return total


def lsim_response(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, e: Prepared
) -> np.ndarray:
    """scipy.signal.lsim with held inputs."""
    from scipy.signal import StateSpace, lsim

    task = e.task
    system = StateSpace(A, B, C, D)
    return np.asarray(lsim(system, task.references, task.time, X0=task.start, interp=False)[1])


def control_response(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, e: Prepared
) -> np.ndarray:
    """control.forced_response of the model discretised by control.sample_system (zoh); a
    continuous model would be fed with straight lines between the samples."""
    import control

    task = e.task
    system = control.sample_system(control.ss(A, B, C, D), task.sample_time, method="zoh")
    found = control.forced_response(
        system, timepts=task.time, inputs=task.references.T, initial_state=task.start
    )
    return np.asarray(found.outputs).T
