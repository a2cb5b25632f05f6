"""Vibration modes of a posture, with the drive closed or with the joints clamped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from core.arm.chord import chord_matrix
from core.arm.slots import LENGTH, slot
from core.simulate.posture import Posture

OSCILLATES = 1e-6
"""A pole oscillates where its imaginary part exceeds this share of its size; below is rounding."""

AT_REST = 1e-9
"""Relative to the largest pole: a pole below that is an integrator seen through rounding."""

SHOWN_SHARE = 0.08
"""A mode is scaled so that its largest displacement is this share of the arm's length."""


@dataclass(frozen=True)
class Mode:
    """One vibration: q(t) = q0 + Re(vector exp(pole t))."""

    pole: complex
    """1/s, of the pair the one with the positive imaginary part."""
    vector: np.ndarray
    """(n,) complex; its largest displacement is real and of a size to be looked at."""

    @property
    def frequency(self) -> float:
        """Hz, at which it is seen to swing."""
        return abs(self.pole.imag) / (2.0 * np.pi)

    @property
    def damping(self) -> float:
        """Damping ratio, 1 where it just no longer swings."""
        return -self.pole.real / abs(self.pole)

    @property
    def shape(self) -> np.ndarray:
        """(n,), the real part of the vector."""
        return np.asarray(self.vector.real)

    def motion(self, q: np.ndarray, frames: int) -> np.ndarray:
        """(frames, n): one period about q (n,), without its decay, so that it can be repeated."""
        phase = np.exp(2j * np.pi * np.arange(frames) / frames)
        return np.asarray(q + np.real(phase[:, None] * self.vector))


def vibration_modes(at: Posture, clamped: bool = False) -> tuple[Mode, ...]:
    """The modes that swing, slowest first: det(s E - A) = 0, or with the joints held."""
    poles, vectors = _clamped(at) if clamped else at.eigen
    n = at.model.arm.coordinates
    swinging = np.flatnonzero(poles.imag > OSCILLATES * np.abs(poles))
    order = swinging[np.argsort(poles.imag[swinging], kind="stable")]
    scales = _displacement_rows(at)
    return tuple(Mode(complex(poles[i]), _scaled(vectors[:n, i], scales, at)) for i in order)


def _clamped(at: Posture) -> tuple[np.ndarray, np.ndarray]:
    """Poles and vectors (n, 2 m) of M v'' + D v' + K v = 0 in the m modal coordinates alone."""
    n, joints = at.model.arm.coordinates, at.model.arm.joints
    free = slice(joints, n)
    m = n - joints
    E, A = np.eye(2 * m), np.zeros((2 * m, 2 * m))
    E[m:, m:] = at.M[free, free]
    A[:m, m:] = np.eye(m)
    A[m:, :m], A[m:, m:] = -at.K[free, free], -at.D[free, free]
    poles, vectors = scipy.linalg.eig(A, E, check_finite=False)
    return poles, np.vstack([np.zeros((joints, 2 * m)), vectors[:m]])


def _displacement_rows(at: Posture) -> np.ndarray:
    """(k, n): from q to displacements in m - of the tip, of each chord, of each joint's segment."""
    arm, p = at.model.arm, at.numbers.p
    lengths = np.array([p[slot(k, LENGTH)] for k in range(arm.joints)])
    tip = at.model.compiled.tip_place(at.q, p)[1]
    turning = np.eye(arm.joints, arm.coordinates)
    arms = [1.0 if s.joint == "prismatic" else lengths[k] for k, s in enumerate(arm.segments)]
    return np.vstack(
        [tip, lengths[:, None] * chord_matrix(arm, p), np.array(arms)[:, None] * turning]
    )


def _scaled(vector: np.ndarray, rows: np.ndarray, at: Posture) -> np.ndarray:
    """The vector (n,) turned in phase and scaled for looking at."""
    sizes = rows @ vector
    largest = sizes[np.argmax(np.abs(sizes))]
    reach = sum(at.numbers.p[slot(k, LENGTH)] for k in range(at.model.arm.joints))
    return np.asarray(vector * (SHOWN_SHARE * reach / largest))


def integrators(poles: np.ndarray) -> np.ndarray:
    """(nx,) bool: the poles at zero, such as a joint's position under a velocity loop."""
    return np.asarray(np.abs(poles) <= AT_REST * np.abs(poles).max(initial=0.0) + OSCILLATES)
