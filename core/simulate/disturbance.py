"""The joint torque that would explain an error of the model: a fixed-interval smoother.

The closed loop around a posture answers a torque at its joints linearly. What is looked for is the
torque, changing as little as it can, with which the model's outputs would be the measured ones
(Rauch, Tung and Striebel 1965; the torque is a random walk). Unlike inverse dynamics it needs no
derivative of an encoder, and the camera keeps the bending from running away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..sensors import sensors
from ..simulate.posture import Posture
from ..simulate.response import exponential, linear_output

AGILITY = tuple((10.0 ** np.arange(-1.0, 3.0, 0.5)).tolist())
"""N m/√s (N/√s): how fast the torque may change."""

TINY = 1e-9
"""Of a state, per sample: the start is not known exactly."""

DOUBLINGS, SETTLED = 40, 1e-9
"""2^40 samples are more than any recording has."""


@dataclass(frozen=True)
class JointTorque:
    """The torque behind an error."""

    torque: np.ndarray
    """(N, joints)"""
    place: np.ndarray
    """(N, joints): what the joints' positions differ by from the model's."""
    speed: np.ndarray
    """(N, joints): what the joints' rates differ by from the model's."""
    likelihood: float
    """Logarithm, up to a constant, of the error."""
    agility: float


def estimate_torque(
    at: Posture,
    channels: Sequence[str],
    error: np.ndarray,
    noise: Sequence[float],
    dt: float,
    agility: float | None = None,
) -> JointTorque | None:
    """error (N, k), measured minus modelled, each sample counting, `dt` s apart; None where no
    channel is a linear output of the posture's motion. `noise` (k,): standard deviations; `agility`
    in N m/√s (N/√s), None: the likeliest of some."""
    rows = [output_rows(at, name) for name in channels]
    measured = [k for k, row in enumerate(rows) if row is not None]
    if not measured:
        return None
    C = np.array([rows[k] for k in measured])
    e, std = error[:, measured], np.asarray(noise, dtype=float)[measured]
    densities = AGILITY if agility is None else (agility,)
    estimates = [_smoothed(at, C, e, std, dt, density) for density in densities]
    converged = [estimate for estimate in estimates if estimate is not None]
    return max(converged, key=lambda estimate: estimate.likelihood) if converged else None


def torque_answer(
    at: Posture, channels: Sequence[str], dt: float, frequencies: np.ndarray
) -> tuple[list[int], np.ndarray]:
    """Which channels are linear outputs of the posture's motion, and how these answer a torque at
    the joints: (F, those, joints) at frequencies (F,) in periods per sample, held over the `dt` s
    of a sample."""
    rows = [output_rows(at, name) for name in channels]
    measured = [k for k, row in enumerate(rows) if row is not None]
    step, nx = _step(at, dt), at.states
    z = np.exp(2j * np.pi * frequencies)
    states = np.linalg.solve(z[:, None, None] * np.eye(nx) - step[:nx, :nx], step[:nx, nx:])
    C = np.array([rows[k] for k in measured]).reshape(len(measured), nx)
    return measured, C @ states


def output_rows(at: Posture, channel: str) -> np.ndarray | None:
    """(nx,): how an output moves with the states; None where it has no such row."""
    for kind, sensor in sensors().items():
        names = [c.name for c in sensor.channels(at.model.arm)]
        if channel not in names:
            continue
        # What is neither stated to be linear nor of the camera has no slopes.
        if sensor.from_camera or sensor.rows(at.model.arm, at.numbers.p, at.numbers.law):
            return linear_output(at, kind).C[names.index(channel)]
    return None


def _smoothed(
    at: Posture, C: np.ndarray, e: np.ndarray, std: np.ndarray, dt: float, agility: float
) -> JointTorque | None:
    nx, joints, n = at.states, at.model.arm.joints, at.model.arm.coordinates
    F = _step(at, dt)
    H = np.hstack([C, np.zeros((len(C), joints))])
    Q = TINY**2 * np.eye(nx + joints)
    Q[nx:, nx:] += agility**2 * dt * np.eye(joints)
    # In units of the noise, or the numbers span fifteen decades.
    H, e = H / std[:, None], e / std
    ahead = _predicted_covariance(F, H, Q)
    if ahead is None:
        return None
    S = H @ ahead @ H.T + np.eye(len(C))
    gain = np.linalg.solve(S, H @ ahead).T
    # Forwards: what is predicted from the samples before each one, corrected by it.
    inputs = np.vstack([np.zeros(len(F)), e[:-1] @ (F @ gain).T])
    predicted = _recursion(F - F @ gain @ H, inputs)
    innovations = e - predicted @ H.T
    filtered = predicted + innovations @ gain.T
    # Backwards: corrected by the samples after it.
    after = ahead - gain @ H @ ahead
    back = np.linalg.solve(ahead, F @ after).T
    inputs = np.vstack([filtered[:-1] @ (np.eye(len(F)) - back @ F).T, filtered[-1:]])
    x = _recursion(back, inputs[::-1])[::-1]
    weighted = np.sum(innovations * np.linalg.solve(S, innovations.T).T)
    likelihood = -0.5 * float(weighted + len(e) * np.linalg.slogdet(S)[1])
    return JointTorque(x[:, nx:], x[:, :joints], x[:, n : n + joints], likelihood, agility)


def _predicted_covariance(F: np.ndarray, H: np.ndarray, Q: np.ndarray) -> np.ndarray | None:
    """Steady state of the filter with unit noise, by doubling the interval (Chu et al. 2005): the
    Schur form of the pencil is too ill-conditioned here. None where it does not settle."""
    A, G, P, identity = F.T, H.T @ H, Q, np.eye(len(F))
    for _ in range(DOUBLINGS):
        W = np.linalg.solve(identity + G @ P, np.hstack([A, G]))
        more = A.T @ P @ W[:, : len(F)]
        G = G + A @ W[:, len(F) :] @ A.T
        A = A @ W[:, : len(F)]
        P = P + 0.5 * (more + more.T)
        if not np.all(np.isfinite(P)):
            return None
        if np.abs(more).max() < SETTLED * np.abs(P).max():
            return P
    return None


def _step(at: Posture, dt: float) -> np.ndarray:
    """(nx + joints, nx + joints): over one sample, the torque held."""
    nx, joints, n = at.states, at.model.arm.joints, at.model.arm.coordinates
    push = np.zeros((nx, joints))
    push[n : n + joints] = np.eye(joints)
    whole = np.zeros((nx + joints, nx + joints))
    whole[:nx] = np.linalg.solve(at.E, np.hstack([at.A, push]))
    return exponential(whole * dt)


def _recursion(A: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """(N, n): x[k] = A x[k - 1] + inputs[k], from rest."""
    x = np.array(inputs)
    for k in range(1, len(x)):
        x[k] += A @ x[k - 1]
    return x
