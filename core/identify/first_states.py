"""Which numbers of a first state are free: as many as there are vibrations that samples can show.

Bending coordinates are amplitudes of polynomials, and most states of them excite vibrations of many
times the sampling rate. No sample shows these, and a fit that lacks an effect uses them: 32 steps
per sample in place of one. So some coordinates are free, and the others follow along the slowest
vibrations.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
import scipy

from ..bounded_cache import BoundedCache
from ..errors import InputError
from ..model import Model
from ..recording.recording import Recording
from ..simulate.motion import at_rest

FREQUENCY_FACTOR = 2.0
"""Factor by which a frequency may be wrong at the start, a stiffness by four."""

START = "start_"
"""Before the name of a coordinate, or 'd' and its name: its deviation at the first sample."""


class _Vibrations:
    """Of a bare arm with its joints held, stretched out."""

    def __init__(self, bare: Model) -> None:
        joints = bare.arm.joints
        K, M = (x[joints:, joints:] for x in bare.stretched_matrices())
        self.bare = bare
        self.names = bare.arm.coordinate_names[joints:]
        squares, shapes = scipy.linalg.eigh(K, M) if len(K) else (np.zeros(0), np.zeros((0, 0)))
        self.shapes: np.ndarray = shapes
        self.rates = np.sqrt(np.maximum(squares, 0.0))
        """rad/s, the slowest first"""
        self._sizes = 1.0 / np.sqrt(np.diag(M))

    def free(self, count: int) -> tuple[str, ...]:
        """The coordinates that determine a state of the `count` slowest vibrations best."""
        if count >= len(self.names):
            return self.names
        shares = (self.shapes[:, :count] / self._sizes[:, None]).T
        order = scipy.linalg.qr(shares, mode="r", pivoting=True)[1][:count]
        return tuple(self.names[i] for i in sorted(order))

    def following(self, free: Collection[str], x: np.ndarray) -> np.ndarray:
        """A deviation x (n,) with those that are not `free` along the slowest vibrations; as it is
        where others are free than these take."""
        count = len(free)
        if not 0 < count < len(self.names) or set(free) != set(self.free(count)):
            return x
        at = [i for i, name in enumerate(self.names) if name in free]
        slow = self.shapes[:, :count]
        return np.asarray(slow @ np.linalg.solve(slow[at], x[at]))


_VIBRATIONS = BoundedCache[_Vibrations](16)
"""By the id of a bare model, which the value keeps."""


def _vibrations(model: Model) -> _Vibrations:
    bare = model.bare or model
    return _VIBRATIONS.get(id(bare), lambda: _Vibrations(bare))


def first_state_names(model: Model, sample_time: float) -> tuple[str, ...]:
    """Names of the initial state's numbers that samples every `sample_time` s may show; with a
    virtual servo, of the coordinates beside the joints."""
    found = _vibrations(model)
    shown = found.rates * sample_time < FREQUENCY_FACTOR * np.pi
    joints = model.arm.coordinate_names[: model.arm.joints] if model.steering is None else ()
    free = (*joints, *found.free(max(int(shown.sum()), 1)))
    return tuple(f"{START}{rate}{q}" for rate in ("", "d") for q in free)


def followed_first_state(model: Model, free: Collection[str], start: np.ndarray) -> np.ndarray:
    """Deviations `start` (n,) of the coordinates, or of their rates, with the bending ones that are
    not `free` (names) along the slowest vibrations."""
    found, names = _vibrations(model), model.arm.coordinate_names
    at = [names.index(name) for name in found.names if name in names]
    if len(at) < len(found.names):
        return start
    out = start.copy()
    out[at] = found.following([name for name in found.names if name in free], start[at])
    return out


def bent_by_weight(model: Model, place: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
    """(n - joints,) the coordinates beside the joints at which an arm is in equilibrium with its
    joints held at `place` (joints,); zero where it does not bend under a weight."""
    n, joints, arm = model.arm.coordinates, model.arm.joints, model.compiled
    if model.level != "nonlinear" or n == joints or not any(model.arm.gravity):
        return np.zeros(n - joints)
    p = model.numbers(values).p
    q, still = at_rest(place, n)[:n], np.zeros(n)
    compliance = np.linalg.pinv(arm.linear_matrices(q, p)[0][joints:, joints:])
    last = np.inf
    while True:
        change = compliance @ arm.mass_and_force(q, still, p)[1][joints:]
        size = float(np.abs(change).max())
        if not size < last:  # a few per cent are left each time, until rounding is
            return q[joints:]
        q[joints:] += change
        last = size


def start_joints(model: Model, recording: Recording) -> np.ndarray:
    """(joints,) at the first sample: from the encoders, else from the stated working point."""
    joints = np.zeros(model.arm.joints)
    for k in range(model.arm.joints):
        name = f"theta{k + 1}"
        if recording.has(name):
            joints[k] = recording[name][0]
        elif k == 1:
            joints[k] = _stated_point(recording)
    return joints


def _stated_point(recording: Recording) -> float:
    if recording.theta2 is None:
        raise InputError(
            f"Recording {recording.name} has neither a column theta2 nor a working point; "
            f"add theta2 = ... (rad) under [[recordings]]."
        )
    return recording.theta2
