"""The cost (13) as one writes it: state-space matrices, a library's response, squared errors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from core.identify.prepared import Prepared
from flexgui.bench.case import NAMES, Case

Response = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, Prepared], np.ndarray]
"""y (N, 2) from A, B, C, D and what one experiment did."""


Matrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def state_space(case: Case, e: Prepared, vector: np.ndarray) -> Matrices:
    """A, B, C, D of all eight states with the loop closed, from E x' = A x + B r, (11)."""
    model, n = case.model, case.model.arm.coordinates
    p, law, _ = model.numbers(dict(zip(NAMES, vector.tolist(), strict=True)))
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
