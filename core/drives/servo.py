"""The stiff virtual servo: follows the recorded joints; its torque is what the model lacks.

Design section 4. For a rig whose joints integrate an open-loop simulation drifts. Here the
recorded torque acts on the model and a servo holds the model's joints on the recorded ones.
With a perfect model the servo has nothing to do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import signal

from core.arm.arm import Arm
from core.drives.drive import Drive
from core.drives.law import DriveLaw, static_law
from core.errors import InputError
from core.recording.recording import Recording
from core.recording.velocity import ZeroPhaseLowPass, central_difference

DEFAULT_HZ = 60.0
"""Reproduces the inverse-dynamics torque within a few per cent; 5 Hz would swallow it."""


def bend(x: np.ndarray) -> np.ndarray:
    """(N, k): how far the straight lines between samples lie beside the curve on average."""
    out = np.zeros_like(x)
    out[1:-1] = np.diff(x, 2, axis=0) / 12.0
    return out


def acceleration(place: np.ndarray, dt: float) -> np.ndarray:
    """(N, k) by second differences, zero at both ends."""
    return bend(place) * (12.0 / dt**2)


def rates(place: np.ndarray, dt: float) -> np.ndarray:
    """(N, k) by central differences."""
    return np.column_stack([central_difference(x, dt) for x in place.T])


@lru_cache
def _response(hz: float, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients for straight lines between samples, and the states of a constant input."""
    w = 2.0 * np.pi * hz
    b, a, _ = signal.cont2discrete(([2.0 * w, w * w], [1.0, 2.0 * w, w * w]), dt, method="foh")
    return np.ravel(b), np.ravel(a), signal.lfilter_zi(np.ravel(b), np.ravel(a))


class Recorded(NamedTuple):
    """What a virtual servo's rig recorded: signals (N, nr) of the drive, and the joints' positions
    and speeds (N, joints)."""

    signals: np.ndarray
    place: np.ndarray
    speed: np.ndarray


@dataclass(frozen=True)
class FollowingServo:
    """A drive together with a servo of double pole `hz` on the rigid inertia of each joint.

    References: those of the drive, then the measured joint positions and velocities.
    """

    base: Drive
    hz: float
    inertia: tuple[float, ...]
    """Diagonal of M at the joints, kg m^2; fixed, so that it does not move with the estimates."""
    smoothing: ZeroPhaseLowPass | None = None
    """Filter of all that was measured, positions before they are differentiated."""

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        """The drive's own feedback acts on the measured joints; the servo on the difference."""
        own = self.base.law(arm, p, values)
        joints = arm.joints
        if own.states or np.any(own.P[:, joints:]) or np.any(own.V[:, joints:]):
            raise InputError(
                f"[drive] kind {self.base.kind!r} sees more than the joints, so its torque cannot "
                f'be replayed; use kind = "torque" with the recorded torque or current.'
            )
        place, speed = self.gains()
        R = np.hstack([own.R, place - own.P[:, :joints], speed - own.V[:, :joints]])
        P, V = np.zeros((joints, arm.coordinates)), np.zeros((joints, arm.coordinates))
        P[:, :joints], V[:, :joints] = place, speed
        return static_law(R, P, V, interpolate=True)

    def gains(self) -> tuple[np.ndarray, np.ndarray]:
        """Diagonal position and velocity gains (joints, joints) of a double pole."""
        w = 2.0 * np.pi * self.hz
        inertia = np.diag(self.inertia)
        return inertia * w * w, inertia * 2.0 * w

    def response(self, x: np.ndarray, dt: float) -> np.ndarray:
        """(N, k): how the joints follow references x (N, k), and how the servo's torque follows
        what is missing: (2 w s + w^2) / (s + w)^2 with w = 2 pi hz, beginning at rest in x[0]."""
        b, a, steady = _response(self.hz, dt)
        found, _ = signal.lfilter(b, a, x, axis=0, zi=np.outer(steady, x[0]))
        return np.asarray(found)

    def signals(self, recording: Recording, arm: Arm) -> np.ndarray:
        """(N, nr + 2 joints)"""
        place, speed = self.motion(recording, arm)
        return np.hstack([self._drive_signals(recording, arm), place, speed])

    def _drive_signals(self, recording: Recording, arm: Arm) -> np.ndarray:
        return self._smoothed(self.base.signals(recording, arm), recording.sample_time)

    def _smoothed(self, columns: np.ndarray, dt: float) -> np.ndarray:
        """(N, k), through the smoothing filter where there is one."""
        if self.smoothing is None or not columns.shape[1]:
            return columns
        return np.column_stack([self.smoothing.apply(x, dt) for x in columns.T])

    def motion(self, recording: Recording, arm: Arm) -> tuple[np.ndarray, np.ndarray]:
        """Measured joint positions and velocities (N, joints), smoothed where so chosen."""
        names = [f"theta{k + 1}" for k in range(arm.joints)]
        dt = recording.sample_time
        place = self._smoothed(np.column_stack([recording[name] for name in names]), dt)
        return place, rates(place, dt)

    def between_samples(self, place: np.ndarray, dt: float) -> np.ndarray:
        """(N, joints): by how much the servo's torque around a sample exceeds that at it.

        `place` (N, joints) are the positions that it follows. The references run straight between
        samples and the arm follows their mean, which lies
        a dt^2 / 12 beside a curve of acceleration a. At the samples the torque is too small by
        the gain times that: at 60 Hz and 1 kHz a mass would come out 1.2 % too large.
        """
        return bend(place) @ self.gains()[0] + bend(rates(place, dt)) @ self.gains()[1]

    def recorded(self, recording: Recording, arm: Arm) -> Recorded:
        """What was measured of drive and joints, smoothed where so chosen."""
        return Recorded(self._drive_signals(recording, arm), *self.motion(recording, arm))

    def recorded_torque(
        self, known: Recorded, arm: Arm, p: np.ndarray, values: Mapping[str, float]
    ) -> np.ndarray:
        """(N, joints): what the drive itself applied along the measured motion."""
        own = self.base.law(arm, p, values)
        joints = arm.joints
        torque = known.signals @ own.R.T
        return torque - known.place @ own.P[:, :joints].T - known.speed @ own.V[:, :joints].T
