"""The linear model at one posture, drive closed: E(kappa) x' = A x + B r, (6-11)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
import scipy

from core.forces.element import linear_matrices
from core.model import Model, Numbers
from core.simulate.motion import at_rest

T = TypeVar("T")


class once(Generic[T]):  # noqa: N801 (reads as the decorator it is)
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
    """The straight arm at rest with its joints at `joints` (nj,), in rad (m on a slide).

    States x = [q, q', s]: coordinates, their rates, the drive's own.
    """

    model: Model
    numbers: Numbers
    joints: np.ndarray

    @once
    def q(self) -> np.ndarray:
        """(n,)"""
        n = self.model.arm.coordinates
        return at_rest(self.joints, n)[:n]

    @once
    def M(self) -> np.ndarray:
        """(n, n)"""
        return self.model.compiled.mass_matrix(self.q, self.numbers.p)

    @once
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

    @once
    def E(self) -> np.ndarray:
        """(nx, nx)"""
        n = self.model.arm.coordinates
        E = np.eye(self.states)
        E[n : 2 * n, n : 2 * n] = self.M
        return E

    @once
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

    @once
    def B(self) -> np.ndarray:
        """(nx, nr)"""
        n, law = self.model.arm.coordinates, self.numbers.law
        B = np.zeros((self.states, law.references))
        B[n : n + self.model.arm.joints] = law.R
        B[2 * n :] = law.Fr
        return B

    @once
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
