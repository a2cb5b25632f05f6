"""Joints that stand still, where no motion shows their dry friction.

At standstill dry friction is any torque between two levels, and the sign of a noisy speed is
chance: a Stribeck friction came out half as large again. So errors are compared without whatever
such a torque adds to them, for every model alike. No sample is lost, only a few directions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from ..drives.servo import FollowingServo, slopes
from ..identify.processing import TORQUE, Processing
from ..recording.recording import Recording
from ..recording.velocity import ZeroPhaseLowPass
from ..recording.visible_band import visible_band

Projection = Callable[[np.ndarray], np.ndarray]
"""(M,) -> its part (M,) in some space."""


@dataclass(frozen=True)
class Standstill:
    """What unknown friction at standstill adds to the compared outputs of a recording."""

    steering: FollowingServo | None
    """The virtual servo; without one nothing is added."""
    recording: Recording
    """With its encoders."""
    processing: Processing
    """The filters of the comparison."""
    kinds: tuple[str, ...]
    """(k,) of the outputs' sensors."""
    counted: np.ndarray
    """(M, k) bool"""

    @cached_property
    def _projections(self) -> dict[int, Projection]:
        """Output -> the projection on what friction at standstill adds to it."""
        torques = [i for i, kind in enumerate(self.kinds) if kind == TORQUE]
        if self.steering is None:
            return {}
        N, dt = len(self.recording.time), self.recording.sample_time
        hz = self.steering.torque_hz
        hz = hz if np.isfinite(hz) else self.steering.hz
        projections = {}
        for k, i in enumerate(torques):
            bases = []
            for at in standstills(self.recording[f"theta{k + 1}"], dt, hz):
                torque = self.steering.response(_polynomials(at, N, hz * dt), dt)
                seen = self.processing.apply(torque, dt, [TORQUE] * len(torque.T))
                bases.append(_local_basis(np.where(self.counted[:, [i]], seen, 0.0)))
            if bases:
                projections[i] = _projection(scipy.sparse.hstack(bases, format="csc"))
        return projections

    def removed_from(self, error: np.ndarray) -> np.ndarray:
        """(M, k): an `error` (M, k), zero where nothing counts, without its part that unknown
        friction at standstill explains."""
        if not self._projections:
            return error
        left = error.copy()
        for i, projection in self._projections.items():
            left[:, i] -= projection(error[:, i])
        return left


EPSILON = float(np.finfo(float).eps)
"""Rounding of a number of order one."""


def _projection(basis: scipy.sparse.csc_matrix) -> Projection:
    """The projection on the columns of a basis (M, d) that are short and hardly overlap: sparse,
    for a recording may stand still hundreds of times."""
    # Of two columns that are nearly the same one is left.
    damping = np.sqrt(EPSILON) * scipy.sparse.identity(basis.shape[1])
    factors = scipy.sparse.linalg.splu((basis.T @ basis + damping).tocsc())
    return lambda x: basis @ factors.solve(basis.T @ x)


def _local_basis(columns: np.ndarray) -> scipy.sparse.csc_matrix:
    """(M, d) orthonormal basis of columns (M, c) that have died out at most rows."""
    rows = np.flatnonzero(np.abs(columns).max(axis=1) > EPSILON * np.abs(columns).max())
    inner = scipy.linalg.orth(columns[rows])
    at = np.repeat(rows, inner.shape[1]), np.tile(np.arange(inner.shape[1]), len(rows))
    return scipy.sparse.csc_matrix((inner.ravel(), at), (len(columns), inner.shape[1]))


def standstills(place: np.ndarray, dt: float, hz: float) -> list[slice]:
    """The samples in which an encoder shows no direction of motion.

    Args:
        place: (N,) rad or m.
        dt: sample time, s.
        hz: highest compared frequency, Hz.

    Returns:
        Stretches of a period of `hz` or more, in which the speed below `hz` is one that noise
        alone may reach. Empty where no noise stands alone in the spectrum.
    """
    band, N = visible_band([(place, dt)]), len(place)
    if band is None or band.whole:
        return []
    low_pass = ZeroPhaseLowPass(cutoff_hz=hz) if hz < 0.5 / dt else None

    def speed(x: np.ndarray) -> np.ndarray:
        smooth = x if low_pass is None else low_pass.apply(x, dt)
        return slopes(smooth[:, None], dt)[:, 0]

    # The largest of n normal numbers is about sqrt(2 ln n) deviations.
    largest = np.sqrt(2.0 * np.log(max(2.0 * min(hz * dt, 0.5) * N, 2.0)))
    gain = float(np.linalg.norm(speed((np.arange(N) == N // 2).astype(float))))
    still = np.abs(speed(place)) <= largest * gain * band.noise
    stretches = [at for (at,) in scipy.ndimage.find_objects(scipy.ndimage.label(still)[0])]
    return [at for at in stretches if (at.stop - at.start) * dt * hz >= 1.0]


def _polynomials(at: slice, N: int, shown: float) -> np.ndarray:
    """(N, d): in a stretch polynomials from a level and a trend on, of which a band of `shown`
    periods per sample shows no more."""
    count = at.stop - at.start
    # Evenly spaced samples determine no polynomial of much more than their root.
    degree = min(int(np.ceil(count * shown)), int(np.sqrt(count)))
    columns = np.zeros((N, degree + 1))
    columns[at] = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, count), degree)
    return columns
