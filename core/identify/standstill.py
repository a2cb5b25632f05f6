"""Joints that stand still, where no motion shows their dry friction.

At standstill dry friction is any torque between two levels, and the sign of a noisy speed is
chance: a Stribeck friction came out half as large again. So errors are compared without whatever
such a torque adds to them, for every model alike. No sample is lost, only a few directions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from ..drives.servo import slopes
from ..identify.processing import TORQUE, Processing
from ..model import Model
from ..recording.recording import Recording
from ..recording.velocity import ZeroPhaseLowPass
from ..recording.visible_band import visible_band


def standstill_basis(
    model: Model, recording: Recording, processing: Processing, kinds: Sequence[str],
    counted: np.ndarray,
) -> tuple[np.ndarray, ...]:  # fmt: skip
    """What unknown friction at standstill adds to the compared outputs.

    Args:
        model: of the rig.
        recording: with its encoders.
        processing: the filters of the comparison.
        kinds: (k,) of the outputs' sensors.
        counted: (M, k) bool.

    Returns:
        Per output (M, d) orthonormal; no columns where nothing stands still, or without a servo.
    """
    bases = [np.zeros((len(counted), 0)) for _ in kinds]
    torques = [i for i, kind in enumerate(kinds) if kind == TORQUE]
    if model.steering is None or not torques:
        return tuple(bases)
    N, dt = len(recording.time), recording.sample_time
    hz = model.steering.torque_hz
    hz = hz if np.isfinite(hz) else model.steering.hz
    for k, i in enumerate(torques):
        stretches = standstills(recording[f"theta{k + 1}"], dt, hz)
        if stretches:
            torque = model.steering.response(_polynomials(stretches, N, hz * dt), dt)
            seen = processing.apply(torque, dt, [TORQUE] * len(torque.T))
            bases[i] = scipy.linalg.orth(np.where(counted[:, [i]], seen, 0.0))
    return tuple(bases)


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


def _polynomials(stretches: Sequence[slice], N: int, shown: float) -> np.ndarray:
    """(N, d): in each stretch polynomials from a level and a trend on, of which a band of `shown`
    periods per sample shows no more."""
    columns = []
    for at in stretches:
        count = at.stop - at.start
        # Evenly spaced samples determine no polynomial of much more than their root.
        degree = min(int(np.ceil(count * shown)), int(np.sqrt(count)))
        columns.append(np.zeros((N, degree + 1)))
        columns[-1][at] = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, count), degree)
    return np.hstack(columns)
