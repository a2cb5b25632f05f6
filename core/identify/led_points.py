"""Points along which a virtual servo leads the joints, and what a rig's samples can show at all."""

from __future__ import annotations

import numpy as np
import scipy

from core.drives.servo import FollowingServo
from core.model import Model
from core.recent import Recent

SWING = 0.5
"""rad that the arm's fastest vibration may swing on from one point of the finer grid to the next: a
cubic spline through these misses 1e-4 of its acceleration, and 1 % at 1.5 rad."""

LED_SWING = 1.0
"""The same of its vibration with the joints led, where the free one is not compared: the joints
take little part in it, and a cubic spline misses 0.2 % of its acceleration."""

FINEST = 8
"""Points per sample: what swings on by pi, as fast as samples can show, takes 6 of SWING."""

UNSURE = 2.0
"""Factor by which a frequency may be wrong at the start, where a stiffness is so four times."""

SELDOM = 2.26
"""rad that a vibration swings on from one sample to the next, beyond which a spline of seventh
degree misses a hundredth of it: (x / (2 pi - x))^8."""


def finer_by(model: Model, sample_time: float) -> int:
    """Points per sample, which lasts `sample_time` s, along which the joints are led.

    Of the bare model stretched out, at its own values: models that are compared, the two ends of a
    difference and all recordings are led along the same points. A vibration that no compared
    output shows needs none; but with its joints led the arm swings more slowly than when they are
    free, and what it then does shows although the free vibration does not.
    """
    bare, servo = model.bare or model, model.steering
    if bare.arm.coordinates == bare.arm.joints:
        return 1
    key = id(bare), id(servo), sample_time
    return _FINER.get(key, lambda: (bare, servo, _finer(bare, servo, sample_time)))[2]


_FINER = Recent[tuple[Model, object, int]](64)
"""Asked for at each simulation of a fit; both objects are kept, so that their identities stay
theirs."""


def _finer(bare: Model, servo: FollowingServo | None, sample_time: float) -> int:
    joints = bare.arm.joints
    K, M = _matrices(bare)
    band = np.inf if servo is None else servo.band_hz
    most = min(2.0 * np.pi * band * sample_time, UNSURE * np.pi)

    def fastest(K: np.ndarray, M: np.ndarray) -> float:
        swing = _swings(K, M, sample_time)
        return float(np.max(swing[swing < most], initial=0.0))

    free, led = fastest(K, M), fastest(K[joints:, joints:], M[joints:, joints:])
    points = max(free / SWING, led / LED_SWING, 1.0)
    return int(np.clip(2 ** np.ceil(np.log2(points)), 1, FINEST))


def sampled_seldom(model: Model, sample_time: float) -> str:
    """A sentence where even the arm's slowest vibration is too fast for the samples, s apart, along
    which its joints are led; empty where they show it."""
    bare = model.bare or model
    K, M = _matrices(bare)
    swings = _swings(K, M, sample_time)
    vibrating = swings[swings > STILL]
    slowest = float(vibrating.min(initial=np.inf))
    if not SELDOM < slowest < np.inf:
        return ""
    hz, rate = slowest / (2.0 * np.pi * sample_time), 1.0 / sample_time
    return (
        f"The arm vibrates at about {hz:.0f} Hz. {rate:.0f} samples per second hardly show that, "
        f"so the model's torques are wrong by some per cent; record at "
        f"{np.ceil(rate * slowest / SELDOM):.0f} Hz or more."
    )


STILL = 1e-3
"""rad per sample: slower is a joint that turns freely."""


def _matrices(bare: Model) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass (n, n) of the arm stretched out, at its own values."""
    n, p = bare.arm.coordinates, bare.numbers().p
    K, _ = bare.compiled.linear_matrices(np.zeros(n), p)
    M = bare.compiled.mass_matrix(np.zeros(n), p)
    return 0.5 * (K + K.T), 0.5 * (M + M.T)


def _swings(K: np.ndarray, M: np.ndarray, sample_time: float) -> np.ndarray:
    """(n,) rad per sample of the vibrations of a stiffness and a mass (n, n)."""
    if not len(K):
        return np.zeros(0)
    return np.asarray(
        np.sqrt(np.maximum(scipy.linalg.eigh(K, M, eigvals_only=True), 0.0)) * sample_time
    )
