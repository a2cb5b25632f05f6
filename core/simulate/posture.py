"""The linear model at one posture, drive closed: E(kappa) x' = A x + B r, (6-11)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
import scipy

from ..arm.chord import chord_matrix
from ..arm.slots import LENGTH, slot
from ..forces.element import linear_matrices
from ..model import Model, Numbers
from ..simulate.motion import at_rest

T = TypeVar("T")


class computed_once(Generic[T]):  # noqa: N801 (reads as the decorator it is)
    """A property computed at its first use and kept.

    `functools.cached_property` has one lock for all objects up to Python 3.11: postures of
    different threads would wait for each other.
    """

    def __init__(self, make: Callable[[Any], T]) -> None:
        self._make, self.__doc__ = make, make.__doc__

    def __get__(self, owner: Any, kind: type) -> T:
        value: T = self._make(owner)
        owner.__dict__[self._make.__name__] = value
        return value


@dataclass(frozen=True)
class Posture:
    """The straight arm at rest at `joints` (nj,), in rad (m on a slide); x = [q, q', s]:
    coordinates, their rates, the drive's states."""

    model: Model
    numbers: Numbers
    joints: np.ndarray

    @computed_once
    def q(self) -> np.ndarray:
        """(n,)"""
        n = self.model.arm.coordinates
        return at_rest(self.joints, n)[:n]

    @computed_once
    def M(self) -> np.ndarray:
        """(n, n)"""
        return self.model.compiled.mass_matrix(self.q, self.numbers.p)

    @computed_once
    def _K_and_D(self) -> tuple[np.ndarray, np.ndarray]:
        K, D = self.model.compiled.linear_matrices(self.q, self.numbers.p)
        K_extra, D_extra = linear_matrices(self.numbers.elements, self.q)
        return K + K_extra, D + D_extra

    @property
    def K(self) -> np.ndarray:
        """-dF/dq (n, n), without the drive."""
        return self._K_and_D[0]

    @property
    def D(self) -> np.ndarray:
        """-dF/dq' (n, n), without the drive."""
        return self._K_and_D[1]

    @property
    def states(self) -> int:
        """nx = 2 n + ns"""
        return 2 * self.model.arm.coordinates + self.numbers.law.states

    @computed_once
    def E(self) -> np.ndarray:
        """(nx, nx)"""
        n = self.model.arm.coordinates
        E = np.eye(self.states)
        E[n : 2 * n, n : 2 * n] = self.M
        return E

    @computed_once
    def A(self) -> np.ndarray:
        """(nx, nx)"""
        n, law = self.model.arm.coordinates, self.numbers.law
        A = np.zeros((self.states, self.states))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n] = -self.K
        A[n : 2 * n, n : 2 * n] = -self.D
        A[n : n + self.model.arm.joints] -= np.hstack([law.P, law.V, law.S])
        A[2 * n :] = np.hstack([law.Fq, law.Fv, law.Fs])
        return A

    @computed_once
    def B(self) -> np.ndarray:
        """(nx, nr)"""
        n, law = self.model.arm.coordinates, self.numbers.law
        B = np.zeros((self.states, law.references))
        B[n : n + self.model.arm.joints] = law.R
        B[2 * n :] = law.Fr
        return B

    @computed_once
    def eigen(self) -> tuple[np.ndarray, np.ndarray]:
        """Poles (nx,) in 1/s and right eigenvectors (nx, nx) of (A, E)."""
        poles, vectors = scipy.linalg.eig(self.A, self.E, check_finite=False)
        return poles, vectors

    @property
    def poles(self) -> np.ndarray:
        """(nx,) in 1/s"""
        return self.eigen[0]


def posture(model: Model, joints: np.ndarray, numbers: Numbers | None = None) -> Posture:
    """The posture at joints (nj,), with the arm's own numbers where none are given."""
    place = np.array(joints, dtype=float)
    return Posture(model, model.numbers() if numbers is None else numbers, place)


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
    """(nx,) bool: the poles (nx,) at zero, such as a joint's position under a velocity loop."""
    return np.asarray(np.abs(poles) <= AT_REST * np.abs(poles).max(initial=0.0) + OSCILLATES)
