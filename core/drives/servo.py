"""The stiff virtual servo: follows the recorded joints; its torque is what the model lacks.

Design section 4. For a rig whose joints integrate an open-loop simulation drifts. Here the
recorded torque acts on the model and a servo holds the model's joints on the recorded ones.
With a perfect model the servo has nothing to do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
import scipy

from ..arm.arm import Arm
from ..bounded_cache import BoundedCache, digest
from ..drives.law import DriveLaw, static_law
from ..errors import InputError
from ..recording.initial_motion import begins_at_rest
from ..recording.recording import Beginning, Recording
from ..recording.velocity import ZeroPhaseLowPass, central_difference

if TYPE_CHECKING:
    from ..drives.drive import Drive

DEFAULT_HZ = 60.0
"""Reproduces the inverse-dynamics torque within a few per cent; 5 Hz would swallow it."""


def chord_error(x: np.ndarray) -> np.ndarray:
    """(N, k): how far the straight lines between samples of x (N, k) lie beside the curve on
    average."""
    out = np.zeros_like(x)
    out[1:-1] = np.diff(x, 2, axis=0) / 12.0
    return out


def acceleration(place: np.ndarray, dt: float) -> np.ndarray:
    """(N, k) by second differences of `place` (N, k), `dt` s apart; zero at both ends."""
    return chord_error(place) * (12.0 / dt**2)


def hold_mean(signals: np.ndarray) -> np.ndarray:
    """(N, nr) at the samples, of signals (N, nr) that a drive holds from each sample to the next.

    At its sample a held signal steps, and what is smooth there sees the mean of both sides: half a
    sample later than the numbers say.
    """
    before = np.vstack([signals[:1], signals[:-1]])
    return 0.5 * (before + signals)


def rates(place: np.ndarray, dt: float) -> np.ndarray:
    """(N, k) by central differences of `place` (N, k), `dt` s apart."""
    return np.column_stack([central_difference(x, dt) for x in place.T])


def slopes(x: np.ndarray, dt: float) -> np.ndarray:
    """(N, k) of the cubic spline through x (N, k), `dt` s apart: what swings by w rad per sample is
    missed by a share of w^4 / 180, by central differences of w^2 / 6 (15 % at 38 Hz in 250 samples
    per second); the noise of white samples is 1.7 times that of these. NaN where a sample is."""
    if len(x) < 2 or not np.isfinite(x).all():
        return np.full(x.shape, np.nan)
    spline = scipy.interpolate.CubicSpline(np.arange(len(x)) * dt, x)
    return np.asarray(spline(spline.x, 1))


def averaged(x: np.ndarray) -> np.ndarray:
    """(N, k): the mean of a smooth x (N, k) over the two samples around each with the weight of a
    triangle, as second differences average an acceleration."""
    return x + chord_error(x)


def rates_along(place: np.ndarray, dt: float, at_rest: bool) -> np.ndarray:
    """(N, k) rates along a motion `place` (N, k), `dt` s apart; zero at its first sample if
    `at_rest`, so that noise starts no motion."""
    speed = rates(place, dt)
    if at_rest:
        speed[0] = 0.0
    return speed


@lru_cache
def _response(hz: float, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients for straight lines between samples, and the states of a constant input."""
    w = 2.0 * np.pi * hz
    b, a, _ = scipy.signal.cont2discrete(
        ([2.0 * w, w * w], [1.0, 2.0 * w, w * w]), dt, method="foh"
    )
    return np.ravel(b), np.ravel(a), scipy.signal.lfilter_zi(np.ravel(b), np.ravel(a))


LEAD = 2
"""Samples at rest before a motion that begins at rest, so that a spline begins flat."""


@dataclass(frozen=True)
class JointMotion:
    """Measured positions (N, joints) of the joints that a virtual servo follows."""

    place: np.ndarray
    before: np.ndarray | None
    """(LEAD, joints) before the first sample; None unless the motion begins at rest."""
    dt: float
    """s"""

    @classmethod
    def measured(cls, place: np.ndarray, dt: float, may_rest: bool, hz: float) -> JointMotion:
        """Of measured positions `place` (N, joints), `dt` s apart, without what is faster than `hz`
        Hz; `may_rest`: whether the motion may begin at rest."""
        at_rest = may_rest and begins_at_rest(place)
        if hz < 0.5 / dt:
            low_pass = ZeroPhaseLowPass(cutoff_hz=hz)
            place = np.column_stack([low_pass.apply(x, dt) for x in place.T])
        return cls(place, np.repeat(place[:1], LEAD, axis=0) if at_rest else None, dt)

    @cached_property
    def speed(self) -> np.ndarray:
        """(N, joints)"""
        return rates_along(self.place, self.dt, at_rest=self.before is not None)

    @cached_property
    def around(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions and speeds (N, joints), averaged around each sample."""
        speed = slopes(self.place, self.dt)
        if self.before is not None:
            speed[0] = 0.0
        return averaged(self.place), averaged(speed)


_MOTIONS = BoundedCache[JointMotion](64 * 2**20, lambda motion: 4 * motion.place.nbytes)
"""Bytes; of the recordings alone, which every model of a search follows."""


class Recorded(NamedTuple):
    """What a virtual servo's rig recorded: signals (N, nr) of the drive, and the joints' positions
    and speeds (N, joints)."""

    signals: np.ndarray
    place: np.ndarray
    speed: np.ndarray


BEYOND = 2.0
"""Times the highest frequency that is compared: there a servo's response exaggerates by 12 %, where
the filters leave a thousandth, and by 2 % at the cut-off of a filter of fourth order."""


class Steering(Protocol):
    """What closes the loop: a drive, or a servo around one."""

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        """Its law on an arm with the numbers p (13 N + 5,) and these parameter values."""

    def signals(self, recording: Recording, arm: Arm) -> np.ndarray:
        """(N, nr): the references that a recording gives it."""


@dataclass(frozen=True)
class FollowingServo:
    """A drive together with a servo of double pole `hz` on the rigid inertia of each joint.

    Another servo is a class derived from this one with `gains` and `response` of its own, which a
    drive states as its `servo`.

    References: those of the drive as they were recorded, the same as what is smooth sees them
    (`held`), then the measured joint positions and velocities.
    """

    base: Drive
    hz: float
    inertia: tuple[float, ...]
    """Diagonal of M at the joints, kg m^2; fixed, so that it does not move with the estimates."""
    band_hz: float = np.inf
    """Hz beyond which nothing is compared, so that no vibration need be followed there."""
    torque_hz: float = np.inf
    """Hz beyond which no torque is compared, of which friction along the joints is a part."""
    faster_loop: bool = False
    """Whether the rig's loop runs faster than its recording, so that a recorded torque is that of
    its instant; else it is held until the next sample."""
    loop_stated: bool = False
    """Whether that is stated; else the smaller error decides."""

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        """The drive's own feedback acts on the measured joints, the servo on the difference; p
        (13 N + 5,). InputError where the drive feeds back more than the joints."""
        own = self.base.law(arm, p, values)
        joints = arm.joints
        if own.states or np.any(own.P[:, joints:]) or np.any(own.V[:, joints:]):
            raise InputError(
                f"[drive] kind {self.base.kind!r} feeds back more than the joints, so its torque "
                f'cannot be replayed; use kind = "torque" with the recorded torque or current.'
            )
        place, speed = self.gains()
        unseen = np.zeros_like(own.R)
        R = np.hstack([unseen, own.R, place - own.P[:, :joints], speed - own.V[:, :joints]])
        P, V = np.zeros((joints, arm.coordinates)), np.zeros((joints, arm.coordinates))
        P[:, :joints], V[:, :joints] = place, speed
        return static_law(R, P, V, interpolate=True)

    def gains(self) -> tuple[np.ndarray, np.ndarray]:
        """Diagonal position and velocity gains (joints, joints) of a double pole."""
        w = 2.0 * np.pi * self.hz
        inertia = np.diag(self.inertia)
        return inertia * w * w, inertia * 2.0 * w

    def response(self, x: np.ndarray, dt: float, hz: float | None = None) -> np.ndarray:
        """(N, k): how the joints follow references x (N, k), `dt` s apart, and how the servo's
        torque follows what is missing: (2 w s + w^2) / (s + w)^2 with w = 2 pi hz, beginning at
        rest in x[0]; of another servo where `hz`, in Hz, is given."""
        b, a, steady = _response(hz or self.hz, dt)
        response, _ = scipy.signal.lfilter(b, a, x, axis=0, zi=np.outer(steady, x[0]))
        return np.asarray(response)

    def signals(self, recording: Recording, arm: Arm) -> np.ndarray:
        """(N, 2 nr + 2 joints)"""
        signals = self.base.signals(recording, arm)
        motion = self.motion(recording, arm)
        return np.hstack([signals, self._at_samples(signals), motion.place, motion.speed])

    def _at_samples(self, signals: np.ndarray) -> np.ndarray:
        """(N, nr): recorded signals (N, nr) as what is smooth sees them at the samples."""
        return signals if self.faster_loop else hold_mean(signals)

    def jumps(self, law: DriveLaw, references: np.ndarray) -> np.ndarray:
        """(N, joints): torque that the drive holds from each sample to the next, of references
        (N, 2 nr + 2 joints) and the servo's law; what its feedback adds is smooth."""
        nr = (law.references - 2 * len(law.R)) // 2
        if self.faster_loop:
            return np.zeros((len(references), len(law.R)))
        return np.asarray(references[:, :nr] @ law.R[:, nr : 2 * nr].T)

    def seen_by_friction(self, place: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions and speeds (N, joints), of `place` (N, joints), `dt` s apart, without the
        encoders' noise, which would turn the sign of a friction wherever a joint rests.

        Through a servo that is faster than all that is compared: one at the frequency of a
        vibration exaggerates it, and a viscous friction came out 10 % too small. Not through a
        symmetric low-pass, which sees a motion before it begins (EMPS: 8 % more error).
        """
        band = min(self.band_hz, self.torque_hz)
        compared = band if np.isfinite(band) else self.hz
        smooth = self.response(place, dt, max(self.hz, BEYOND * compared))
        return smooth, slopes(smooth, dt)

    def is_smoothed(self, dt: float) -> bool:
        """Whether joints that were recorded every `dt` s are followed without what is fast."""
        return BEYOND * self.torque_hz < 0.5 / dt

    def motion(self, recording: Recording, arm: Arm) -> JointMotion:
        """The measured joints.

        Without what lies beyond the torques that are compared: the square of a noisy speed has a
        mean, and of an encoder of 13 bits, sampled at 2 kHz, that was 2 % of the torque.
        """
        place = np.column_stack([recording[f"theta{k + 1}"] for k in range(arm.joints)])
        dt, may_rest = recording.sample_time, recording.beginning is not Beginning.MOTION
        hz = BEYOND * self.torque_hz
        return _MOTIONS.get(
            (digest(place), place.shape, dt, may_rest, hz),
            lambda: JointMotion.measured(place, dt, may_rest, hz),
        )

    def between_samples(self, place: np.ndarray, dt: float) -> np.ndarray:
        """(N, joints): by how much the servo's torque around a sample exceeds that at it.

        `place` (N, joints) are the positions that it follows, `dt` s apart. The references run
        straight between samples and the arm follows their mean, which lies a dt^2 / 12 beside a
        curve of acceleration a. At the samples the torque is too small by the gain times that: at
        60 Hz and 1 kHz a mass would come out 1.2 % too large.
        """
        return (
            chord_error(place) @ self.gains()[0] + chord_error(rates(place, dt)) @ self.gains()[1]
        )

    def recorded(self, recording: Recording, arm: Arm) -> Recorded:
        """What was measured of drive and joints."""
        signals, motion = self.base.signals(recording, arm), self.motion(recording, arm)
        return Recorded(self._at_samples(signals), motion.place, motion.speed)

    def recorded_around(self, recording: Recording, arm: Arm) -> Recorded:
        """The same, averaged around each sample as the torque along a prescribed motion is."""
        signals, motion = self.base.signals(recording, arm), self.motion(recording, arm)
        around = averaged(signals) if self.faster_loop else hold_mean(signals)
        return Recorded(around, *motion.around)

    def recorded_torque(self, measured: Recorded, arm: Arm, own: DriveLaw) -> np.ndarray:
        """(N, joints): what the drive itself, with its law, applied along the measured motion."""
        joints = arm.joints
        torque = measured.signals @ own.R.T
        return torque - measured.place @ own.P[:, :joints].T - measured.speed @ own.V[:, :joints].T
