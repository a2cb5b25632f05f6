"""A rigid double pendulum in a plane with Stribeck friction: explicit, by hand, and slow.

Its equations are those of a textbook (two uniform rods), its friction a smooth law of the joints'
speeds, its integrator a Runge-Kutta method of fourth order with very short steps. Nothing of it
comes from the program that it tests.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

STEP = 4e-6
"""s"""
STICK = 1e-4
"""rad/s over which dry friction changes its sign; ten times as much moves the friction found."""


@dataclass(frozen=True)
class DoublePendulum:
    """Two rods, their friction, and the controller that makes the recorded torque."""

    lengths: tuple[float, float] = (0.5, 0.4)
    """m"""
    masses: tuple[float, float] = (3.0, 2.0)
    """kg"""
    viscous: tuple[float, float] = (0.3, 0.2)
    """N m s/rad"""
    coulomb: tuple[float, float] = (0.6, 0.4)
    """N m"""
    bulge: tuple[float, float] = (0.4, 0.2)
    """N m, of the friction at standstill above the Coulomb level."""
    stribeck_speed: tuple[float, float] = (0.1, 0.1)
    """rad/s"""
    gains: tuple[float, float, float, float] = (60.0, 25.0, 12.0, 5.0)
    """N m/rad of both joints, then N m s/rad, of a controller that follows a reference."""

    def recorded(self, places: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Joint angles (N, 2) rad and held torques (N, 2) N m along references (N, 2), from rest
        at the first reference."""
        friction = np.array([self.viscous, self.coulomb, self.bulge, self.stribeck_speed])
        return _simulated(
            np.ascontiguousarray(places), dt, np.array([*self.lengths, *self.masses]), friction,
            np.array(self.gains),
        )  # fmt: skip


@njit(cache=True)
def _acceleration(q, v, u, rods, friction):  # type: ignore[no-untyped-def]
    l1, l2, m1, m2 = rods
    c, s = np.cos(q[1]), np.sin(q[1])
    a = l1 * l1 * (m1 / 3.0 + m2) + l1 * l2 * m2 * c + l2 * l2 * m2 / 3.0
    b = l2 * m2 * (3.0 * l1 * c + 2.0 * l2) / 6.0
    d = l2 * l2 * m2 / 3.0
    h = 0.5 * l1 * l2 * m2 * s
    w = np.empty(2)
    for k in range(2):
        x = v[k]
        dry = friction[1, k] + friction[2, k] * np.exp(-((x / friction[3, k]) ** 2))
        w[k] = u[k] - friction[0, k] * x - dry * np.tanh(x / STICK)
    w[0] += h * (2.0 * v[0] * v[1] + v[1] * v[1])
    w[1] -= h * v[0] * v[0]
    det = a * d - b * b
    return np.array([(d * w[0] - b * w[1]) / det, (a * w[1] - b * w[0]) / det])


@njit(cache=True)
def _simulated(places, dt, rods, friction, gains):  # type: ignore[no-untyped-def]
    N, steps = len(places), int(round(dt / STEP))
    h = dt / steps
    q, v = places[0].copy(), np.zeros(2)
    seen, applied = np.empty((N, 2)), np.empty((N, 2))
    before = places[0].copy()
    for i in range(N):
        u = gains[:2] * (places[i] - q) + gains[2:] * ((places[i] - before) / dt - v)
        seen[i], applied[i] = q, u
        before = places[i].copy()
        for _ in range(steps):
            k1 = _acceleration(q, v, u, rods, friction)
            k2 = _acceleration(q + 0.5 * h * v, v + 0.5 * h * k1, u, rods, friction)
            p2 = v + 0.5 * h * k1
            p3 = v + 0.5 * h * k2
            k3 = _acceleration(q + 0.5 * h * p2, p3, u, rods, friction)
            p4 = v + h * k3
            k4 = _acceleration(q + h * p3, p4, u, rods, friction)
            q = q + h / 6.0 * (v + 2.0 * p2 + 2.0 * p3 + p4)
            v = v + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return seen, applied
