"""Where the joints go between samples that do not show how the arm vibrates.

The drive holds its torque from each sample to the next, and the arm answers to that as it does. So
the model is moved by the recorded torques while a slow servo keeps it near the encoders. What these
say beyond the model is smooth, since the vibration, however fast, is in both; a spline through that
and the model's own motion tell where the joints were between the samples.

A vibration at the wrong frequency guides worse than none, so a fit begins with the first swings of
each recording (core.identify.growing).
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np
import scipy

from core.arm.structure import Structure
from core.drives.law import DriveLaw
from core.drives.servo import FollowingServo
from core.identify.led_points import fastest_swing, finer_by
from core.model import Model, Numbers
from core.recent import Recent
from core.simulate.many import Job, run_many_extrapolated
from core.simulate.motion import Task

KEEPING_HZ, SEEING_HZ = 0.3, 3.0
"""Of the servo, and of the low-pass of third order through which it sees how far the joints are
from the encoders. A servo that sees them at once would damp the vibration, which no drive does: at
0.2 Hz half of a vibration of 164 Hz was gone. Through a low-pass of second order it answered to
what straight lines between samples say of the vibration, ten times as much as of third order."""

SWING = 0.035
"""rad by which the fastest vibration swings on in one step; steps are extrapolated. With 0.07 rad a
complete model missed 2 % of the torque of a link after a hundred swings, with this 0.2 %."""

CAPACITY = 32 * 2**20
"""Bytes: a thousand motions of a thousand points."""


class _Guide(NamedTuple):
    """A task, kept so that the identities of its arrays stay theirs, and where it leads."""

    task: Task
    place: np.ndarray


_KNOWN = Recent[_Guide](CAPACITY, lambda one: one.place.nbytes)


def is_guided(model: Model) -> bool:
    """Whether the joints follow the model's own answer between samples."""
    servo = model.steering
    return isinstance(servo, FollowingServo) and servo.guided and model.level == "nonlinear"


def guide(model: Model, numbers: Numbers, task: Task) -> np.ndarray:
    """(finer (N - 1) + 1, joints): where the recorded torques take the joints of a guided model,
    at the points of the finer grid (`finer_by`); NaN where the simulation goes astray."""

    def made() -> _Guide:
        (moved,) = run_many_extrapolated(
            [_job(model, numbers, task)], steps_between(model, task.sample_time)
        )
        return _Guide(task, moved.q[:, : model.arm.joints])

    return _KNOWN.get(decisive(model, numbers, task), made).place


def guide_all(requests: Sequence[tuple[Model, Numbers, Task]], workers: int) -> None:
    """Simulates the guides of several motions side by side, so that each is at hand."""
    each = {decisive(*one): one for one in requests if is_guided(one[0])}
    missing = {key: one for key, one in each.items() if key not in _KNOWN}
    steps = {
        key: steps_between(model, task.sample_time) for key, (model, _, task) in missing.items()
    }
    for count in set(steps.values()):
        some = {key: one for key, one in missing.items() if steps[key] == count}
        found = run_many_extrapolated([_job(*one) for one in some.values()], count, workers)
        for (key, (model, _, task)), moved in zip(some.items(), found, strict=True):
            _KNOWN.put(key, _Guide(task, moved.q[:, : model.arm.joints]))


def steps_between(model: Model, sample_time: float) -> int:
    """From one point of the finer grid to the next, a power of two. Of the bare model: a bending
    shape more is faster still and takes little part in a motion."""
    bare, dt = model.bare or model, sample_time / finer_by(model, sample_time)
    needed = max(fastest_swing(bare, bare.numbers(), dt) / SWING, 2.0)
    return int(2 ** round(np.log2(needed)))


def decisive(model: Model, numbers: Numbers, task: Task) -> Hashable:
    """All that a guide depends on."""
    elements = numbers.elements + numbers.beside
    forces = tuple((hash(e.law), e.values, e.at_tip, _bytes(e.directions)) for e in elements)
    own = numbers.p.tobytes(), numbers.law.R.tobytes(), forces, task.start.tobytes()
    structure = Structure.of(model.arm), finer_by(model, task.sample_time)
    return id(task.references), *own, structure


def _bytes(arrays: Sequence[np.ndarray]) -> tuple[bytes, ...]:
    return tuple(array.tobytes() for array in arrays)


def _job(model: Model, numbers: Numbers, task: Task) -> Job:
    """The simulation at the points of the finer grid."""
    servo, joints = model.steering, model.arm.joints
    assert isinstance(servo, FollowingServo)
    finer = finer_by(model, task.sample_time)
    place = task.references[:, -2 * joints : -joints]
    smooth, stepping = torques(model, numbers, task)
    at = np.arange(finer * (len(place) - 1) + 1) / finer
    columns = np.hstack([place, smooth]).T
    straight = np.column_stack([np.interp(at, np.arange(len(place)), x) for x in columns])
    law = keeping(servo, model.arm.coordinates)
    time = np.arange(len(at)) * (task.sample_time / finer)
    moved = Task(time, np.hstack([straight, stepping[at.astype(int)]]), task.start, task.schedule)
    # Friction brakes the arm and shakes it where a joint turns round, so it is part of a guide.
    whole = numbers._replace(law=law, elements=numbers.elements + numbers.beside, beside=())
    return Job(model, whole, moved)


def keeping(servo: FollowingServo, n: int) -> DriveLaw:
    """The slow servo on the inertias of another, of an arm of n coordinates.

    References: places, a torque that runs straight between samples, and one that is held.
    """
    inertia = np.asarray(servo.inertia)
    joints = len(inertia)
    one, none, rest = np.eye(joints), np.zeros((joints, joints)), np.zeros((joints, n))
    w, see = 2.0 * np.pi * KEEPING_HZ, 2.0 * np.pi * SEEING_HZ
    stiff, damping = np.diag(inertia) * w * w, np.diag(inertia) * 2.0 * w
    chain = np.array([[-see, 0.0, 0.0], [see, -see, 0.0], [0.0, see, -see]])
    first = np.array([[see], [0.0], [0.0]])
    return DriveLaw(
        R=np.hstack([none, one, one]), P=rest, V=rest,
        S=-np.hstack([none, see * damping, stiff - see * damping]),
        Fs=np.kron(chain, one), Fq=-np.kron(first, np.eye(joints, n)), Fv=np.zeros((3 * joints, n)),
        Fr=np.kron(first, np.hstack([one, none, none])),
        limit=np.full(joints, np.inf), interpolate=True, held=joints,
    )  # fmt: skip


def kept(servo: FollowingServo, apart: np.ndarray, dt: float) -> np.ndarray:
    """(N, joints): the slow servo's torque where the joints are `apart` (N, joints) from where they
    should be, from rest: inertia (2 w s + w^2) (c / (s + c))^3."""
    w, c = 2.0 * np.pi * KEEPING_HZ, 2.0 * np.pi * SEEING_HZ
    rational = c**3 * np.array([2.0 * w, w * w]), np.poly([-c, -c, -c])
    b, a, _ = scipy.signal.cont2discrete(rational, dt, method="foh")
    return np.asarray(scipy.signal.lfilter(np.ravel(b), np.ravel(a), apart, axis=0) * servo.inertia)


def torques(model: Model, numbers: Numbers, task: Task) -> tuple[np.ndarray, np.ndarray]:
    """(N, joints) each, at the samples: what the drive's own feedback on the recorded joints adds,
    which is smooth, and what it holds from each sample to the next."""
    servo, joints = model.steering, model.arm.joints
    assert isinstance(servo, FollowingServo)
    place, speed = np.split(task.references[:, -2 * joints :], 2, axis=1)
    by_place, by_speed = servo.own_feedback(numbers.law)
    smooth = -place @ by_place.T - speed @ by_speed.T
    return smooth, servo.jumps(numbers.law, task.references)
