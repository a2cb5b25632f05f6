"""What the comparisons are held against: the cost and the non-linear arm as one writes them.

The cost (13): state-space matrices, a library's response, squared errors. The arm: our compiled
equations, in solve_ivp.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from flexgui.core.identify.prepared_recording import Prepared
from flexgui.core.model import Model
from flexgui.core.simulate.motion import Task
from tests.programs.bench.case import NAMES, Case

UNSEEN = 1e-9
"""Share of the largest entry of C in modal coordinates: a mode below it, a joint's position beside
velocities, moves no output."""
ABSOLUTE = 1e-3
"""Absolute over relative tolerance: the bending is a thousandth of its rates."""


def gauss_order(modes: int) -> int:
    """Gauss points that integrate |dp/dq|^2 along a segment exactly.

    The highest power of x in p is that of the foreshortening, 2 modes + 1 (1 for a rigid
    segment), so the integrand has degree at most 2 (2 modes + 1).
    """
    return 2 * modes + 2


@dataclass(frozen=True)
class Setting:
    """How solve_ivp is called; it starts anew at every change of the input."""

    method: str
    rtol: float

    def __str__(self) -> str:
        return f"{self.method}, rtol {self.rtol:.0e}, restarted at every change of the input"


def held_stretches(task: Task) -> list[tuple[int, int]]:
    """(first, last) sample of each stretch of constant references."""
    changed = np.any(np.diff(task.references, axis=0) != 0.0, axis=1)
    edges = [0, *(np.flatnonzero(changed) + 1).tolist(), len(task.time) - 1]
    return [(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True) if a < b]


def integrate(model: Model, task: Task, setting: Setting) -> np.ndarray:
    """States (N, 2 n) at the samples of a model with a static drive, from our compiled equations
    and solve_ivp; not a number after a failure."""
    (p, law, *_), n = model.numbers(), model.arm.coordinates
    feedback = np.hstack([law.P, law.V])
    states = np.full((len(task.time), 2 * n), np.nan)
    states[0] = task.start
    options = {"method": setting.method, "rtol": setting.rtol, "atol": setting.rtol * ABSOLUTE}

    def rate(_: float, x: np.ndarray, drive: np.ndarray) -> np.ndarray:
        M, f = model.compiled.mass_and_force(x[:n], x[n:], p)
        f[: len(drive)] += drive - feedback @ x
        return np.concatenate([x[n:], np.linalg.solve(M, f)])

    for a, b in held_stretches(task):
        t, drive = task.time[a : b + 1], law.R @ task.references[a]
        found = scipy.integrate.solve_ivp(
            rate, (t[0], t[-1]), states[a], t_eval=t, args=(drive,), **options
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


def modal_response(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, e: Prepared
) -> np.ndarray:
    """Mode by mode through scipy.signal.lfilter, one of each conjugate pair; modes that no output
    sees are left out. Exact for held inputs, as lsim is."""
    from scipy.signal import lfilter

    task, step = e.task, e.task.sample_time
    poles, V = np.linalg.eig(A)
    inputs, start, rows = np.linalg.solve(V, B), np.linalg.solve(V, task.start), C @ V
    size = np.abs(rows).max(axis=0)
    kept = np.flatnonzero((poles.imag >= 0.0) & (size > UNSEEN * size.max()))
    modes = np.empty((len(kept), len(task.time)), dtype=complex)
    for mode, i in zip(modes, kept, strict=True):
        gain = step if poles[i] == 0.0 else np.expm1(poles[i] * step) / poles[i]
        driven = task.references @ (gain * inputs[i])
        mode[:] = lfilter([0.0, 1.0], [1.0, -np.exp(poles[i] * step)], driven, zi=[start[i]])[0]
    pairs = np.where(poles[kept].imag > 0.0, 2.0, 1.0)
    return np.asarray((modes.T @ (rows[:, kept] * pairs).T).real + task.references @ D.T)


def exact_response(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, e: Prepared
) -> np.ndarray:
    """The reference: the matrix exponential step by step, with more digits than a double has."""
    task, (nx, nr) = e.task, B.shape
    whole = np.zeros((nx + nr, nx + nr))
    whole[:nx] = np.hstack([A, B]) * task.sample_time
    step = np.asarray(scipy.linalg.expm(whole)[:nx], dtype=np.longdouble)
    x, found = np.asarray(task.start, dtype=np.longdouble), []
    for r in task.references:
        found.append(C @ x + D @ r)
        x = step[:, :nx] @ x + step[:, nx:] @ r
    return np.asarray(found, dtype=float)


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
