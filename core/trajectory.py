"""A simulated motion and what follows from it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

import numpy as np

from .arm.arm import Arm
from .arm.compiled import CompiledArm

MOST_KEPT = 16
"""Series along one motion: forces of some joints, for the two ends of a difference."""


@dataclass(frozen=True)
class Trajectory:
    """States at the samples; angles in rad (m on a slide), torques in N m (N)."""

    arm: Arm
    compiled: CompiledArm
    p: np.ndarray
    time: np.ndarray
    q: np.ndarray
    """(N, n)"""
    v: np.ndarray
    """(N, n), the rates of q"""
    torque: np.ndarray
    """(N, joints), as the drive applies it"""
    linear: bool = False
    """Whether it comes from the linear model, whose outputs are linear in the state."""
    _cache: dict[Hashable, np.ndarray] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def cached(self, key: Hashable, make: Callable[[], np.ndarray]) -> np.ndarray:
        """The array of any shape stored under the key, else the result of `make`. The last
        MOST_KEPT are stored; they are read-only."""
        values = self._cache.get(key)
        if values is None:
            values = make()
            while len(self._cache) >= MOST_KEPT:
                self._cache.pop(next(iter(list(self._cache)), key), None)
            self._cache[key] = values
        return values

    @property
    def joint_positions(self) -> np.ndarray:
        """(N, joints), rad (m where a joint slides)."""
        return self.q[:, : self.arm.joints]

    def tip(self) -> tuple[np.ndarray, np.ndarray]:
        """Place (N, 2) in m and velocity (N, 2) in m/s of the end effector."""
        from .arm.evaluation import tip_path

        q, v = np.ascontiguousarray(self.q), np.ascontiguousarray(self.v)
        return tip_path(self.compiled.addresses, q, v, self.p)
