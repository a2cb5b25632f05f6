"""A bending link on a motor by linear finite elements: a second opinion beside the engines.

Euler-Bernoulli, cubic Hermite elements, clamped to a hub that turns; the absolute lateral
displacement is x theta + w(x). Everything is linear, so a held input is integrated exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

ELEMENTS = 16
MODES = 8
"""Free vibrations that are kept; the highest lies above what any recording here samples."""


@dataclass(frozen=True)
class Beam:
    """One link, its hub and what acts on the joint."""

    length: float = 0.8
    """m"""
    mass: float = 2.0
    """kg"""
    EI: float = 90.0
    """N m²"""
    hub_inertia: float = 0.05
    """kg m²"""
    viscous: float = 0.0
    """N m s/rad, at the joint."""
    damping_time: float = 0.0
    """s, of the material (Kelvin-Voigt)."""
    loop_gain: float = 0.0
    """N m s/rad; zero: the input is a torque, else a reference of the joint's speed."""

    @cached_property
    def matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """M and K of [theta, w1, w1', ..., wn, wn']."""
        h, rho = self.length / ELEMENTS, self.mass / self.length
        size = 2 * ELEMENTS + 2
        M, K = np.zeros((size + 1, size + 1)), np.zeros((size + 1, size + 1))
        nodes, weights = np.polynomial.legendre.leggauss(4)
        for e in range(ELEMENTS):
            at = slice(1 + 2 * e, 5 + 2 * e)
            for s, weight in zip(0.5 * (nodes + 1.0), 0.5 * h * weights, strict=True):
                shape = np.array([1 - 3 * s**2 + 2 * s**3, h * s * (1 - s) ** 2,
                                  3 * s**2 - 2 * s**3, h * s**2 * (s - 1)])  # fmt: skip
                bent = np.array([12 * s - 6, h * (6 * s - 4), 6 - 12 * s, h * (6 * s - 2)]) / h**2
                row = np.zeros(size + 1)
                row[0], row[at] = (e + s) * h, shape
                M += rho * weight * np.outer(row, row)
                K[at, at] += self.EI * weight * np.outer(bent, bent)
        M[0, 0] += self.hub_inertia
        kept = np.r_[0, 3 : size + 1]  # the root is clamped to the hub
        return M[np.ix_(kept, kept)], K[np.ix_(kept, kept)]

    def motion(self, signal: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """theta (N,) rad and the tip's deflection (N,) m from rest, of a held input (N,)."""
        M, K = self.matrices
        powers, modes = scipy.linalg.eigh(K, M)
        modes, powers = modes[:, : MODES + 1], np.maximum(powers[: MODES + 1], 0.0)
        joint, n = modes[0], MODES + 1
        D = np.outer(joint, joint) * (self.viscous + self.loop_gain) + np.diag(
            self.damping_time * powers
        )
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(powers), -D]])
        B = np.r_[np.zeros(n), joint * (self.loop_gain or 1.0)]
        step = scipy.linalg.expm(np.block([[A, B[:, None]], [np.zeros((1, 2 * n + 1))]]) * dt)
        x, states = np.zeros(2 * n), np.empty((len(signal), n))
        for i, u in enumerate(signal):
            states[i] = x[:n]
            x = step[: 2 * n, : 2 * n] @ x + step[: 2 * n, 2 * n] * u
        return states @ joint, states @ modes[-2]

    def tip(self, theta: np.ndarray, deflection: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """z1, z2 (N,) m."""
        c, s = np.cos(theta), np.sin(theta)
        return self.length * c - deflection * s, self.length * s + deflection * c
