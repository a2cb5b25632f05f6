"""Arms, models and small mathematics that several tests share."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numba import njit

from flexgui.core.arm.arm import Arm, Structure
from flexgui.core.arm.compiled import CompiledArm, compile_arm
from flexgui.core.arm.presets import presets
from flexgui.core.arm.segment import Segment
from flexgui.core.drives.law import DriveLaw
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.errors import InputError
from flexgui.core.lanes.wide import LANES
from flexgui.core.model import Model, Numbers
from flexgui.core.recording.recording import Recording
from flexgui.core.sensors import sensor
from flexgui.core.simulate import discrete
from flexgui.core.simulate.batch import Job, finished, passes
from flexgui.core.simulate.motion import Task, at_rest
from flexgui.core.simulate.nonlinear import extrapolated
from flexgui.core.trajectory import Trajectory

PAPER = presets()["paper"]
LAMBDA = (60.0, 30.0)
"""N m s/rad, the gains of design section 2."""

_LENGTHS, _MASSES, _STIFFNESS = (0.5, 0.45, 0.4), (7.5, 5.0, 3.0), (520.83, 400.0, 300.0)


def chain(*modes: int) -> Arm:
    """Revolute joints; one segment per number of modes, no two alike."""
    segments = [
        Segment(length=_LENGTHS[k], mass=_MASSES[k], EI=_STIFFNESS[k], modes=m)
        for k, m in enumerate(modes)
    ]
    return Arm(segments=tuple(segments), name="-".join(map(str, modes)))


def _slide() -> Arm:
    """A slide at an angle that carries a bending link."""
    carriage = Segment(length=0.3, mass=4.0, modes=0, joint="prismatic", axis_angle=0.4)
    return Arm(segments=(carriage, chain(0, 2).segments[1]), name="slide")


def _grounded() -> Arm:
    """A turning link; beside it, on the ground, a sliding link that carries a third."""
    sliding = Segment(
        length=0.45, mass=5.0, EI=400.0, modes=1, joint="prismatic", axis_angle=-0.7, mount="ground"
    )
    return Arm(segments=(chain(1).segments[0], sliding, chain(0, 0, 0).segments[2]), name="ground")


ARMS: dict[str, Arm] = {
    "one mode": chain(1),
    "three modes": chain(3),
    "rigid pair": chain(0, 0),
    "1-1": chain(1, 1),
    "2-2": chain(2, 2),
    "3-3": chain(3, 3),
    "slide": _slide(),
    "ground": _grounded(),
    "0-2-1": chain(0, 2, 1),
    "1-1-1": chain(1, 1, 1),
    "3-3-3": chain(3, 3, 3),
}
"""The structures that the tests compile; a new one costs a second or more, so reuse these."""

EVERY_ARM = [pytest.param(n, marks=pytest.mark.long) if n == "3-3-3" else n for n in ARMS]
"""Nine shapes take 23 s to compile: three in one segment are those of 3-3, and three segments that
all bend those of 1-1-1."""


def with_modes(*modes: int) -> Arm:
    """The paper's arm with other numbers of modes."""
    pairs = zip(PAPER.segments, modes, strict=True)
    segments = tuple(s.model_copy(update={"modes": m}) for s, m in pairs)
    return PAPER.model_copy(update={"segments": segments})


def loaded(arm: Arm, gravity: tuple[float, float] = (0.0, 0.0)) -> Arm:
    """The arm with every inertia and damping present, different for each segment."""
    segments = tuple(
        s.model_copy(
            update={
                "damping_time": 1e-3 * (k + 1),
                "tip_mass": 0.5 + 0.3 * k,
                "tip_inertia": 0.01 * (k + 1),
                "hub_inertia": 0.2 / (k + 1),
                "rotor_inertia": 0.05 * (k + 1),
            }
        )
        for k, s in enumerate(arm.segments)
    )
    return arm.model_copy(update={"segments": segments, "gravity": gravity})


def compiled(arm: Arm) -> CompiledArm:
    return compile_arm(Structure.of(arm))


def looped(arm: Arm, gain: float | None = None, level: str = "nonlinear") -> Model:
    """The arm with a velocity loop: the paper's gains for two joints, one gain for others."""
    gains = LAMBDA if arm.joints == 2 and gain is None else (gain or 0.0,) * arm.joints
    return Model(arm, VelocityLoop(gains=gains), level)


def random_state(arm: Arm, seed: int, bend: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """q and q' (n,) with joints anywhere and deflections of about `bend` times the length."""
    rng = np.random.default_rng(seed)
    q, v = rng.uniform(-1.0, 1.0, (2, arm.coordinates))
    q[: arm.joints] *= 2.5
    for k, segment in enumerate(arm.segments):
        scale = [bend / segment.length ** (i + 1) for i in range(segment.modes)]
        q[arm.modal_slice(k)] *= scale
        v[arm.modal_slice(k)] *= scale
    return q, v


def straight(joints: np.ndarray, arm: Arm) -> np.ndarray:
    """q (n,) of the straight arm."""
    return at_rest(joints, arm.coordinates)[: arm.coordinates]


def task_from(
    model: Model, start: np.ndarray, references: np.ndarray, dt: float = 1e-3, t0: float = 0.0
) -> Task:
    """A task from a full start state and references (N, nr)."""
    time = t0 + np.arange(len(references)) * dt
    return Task(time, references, start, start[None, : model.arm.coordinates])


def from_rest(
    model: Model, joints: Sequence[float], references: np.ndarray, dt: float = 1e-3
) -> Task:
    """A task from rest with the joints at these places and references (N, nr)."""
    return task_from(model, at_rest(np.array(joints), model.arm.coordinates), references, dt)


def read(model: Model, task: Task, motion: Trajectory, *kinds: str) -> Recording:
    """What sensors of these kinds read of a motion without noise, beside its references."""
    names = model.drive.reference_channels(model.arm)
    channels = {name: task.references[:, k] for k, name in enumerate(names)}
    for kind in kinds:
        seen = np.array(sensor(kind).measure(motion))
        channels |= {c.name: seen[:, k] for k, c in enumerate(sensor(kind).channels(model.arm))}
    return Recording("r", task.time, channels)


@njit
def solve(A, n, b, columns):  # type: ignore[no-untyped-def]
    """What only compiled code may call."""
    discrete.solve(A, n, b, columns)


def state_matrices(
    model: Model, numbers: Numbers, joints: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A and B of x' = A x + B r with the drive closed, at the straight arm with these joints."""
    p, law = numbers.p, numbers.law
    n, ns, nr = model.arm.coordinates, law.states, law.references
    names = ("R", "P", "V", "S", "Fs", "Fq", "Fv", "Fr")
    laws = tuple(np.ascontiguousarray(getattr(law, name)[None], dtype=float) for name in names)
    work = discrete.work_arrays(n, ns, nr)
    q = straight(joints, model.arm)
    for lane in range(LANES):
        discrete.place(model.compiled.dynamics, model.compiled.linear, p, q, laws, 0, lane, work)
    columns = 2 * n + ns + nr
    solve(work[5], n, work[6], columns)
    rows = work[6].reshape(n + ns, columns, LANES)[:, :, 0]
    A = np.vstack([np.eye(n, 2 * n + ns, k=n), rows[:, : 2 * n + ns]])
    return A, np.vstack([np.zeros((n, nr)), rows[:, 2 * n + ns :]])


def state_rate(
    model: Model, numbers: Numbers, x: np.ndarray, r: np.ndarray, inertia: np.ndarray | None = None
) -> np.ndarray:
    """x' of the non-linear model for x = [q, q', s]; with a given M instead of M(q) if asked."""
    p, law = numbers.p, numbers.law
    n = model.arm.coordinates
    q, v, s = x[:n], x[n : 2 * n], x[2 * n :]
    M, F = model.compiled.mass_and_force(q, v, p)
    F[: model.arm.joints] += torque_of(law, q, v, s, r)
    acceleration = np.linalg.solve(M if inertia is None else inertia, F)
    return np.concatenate([v, acceleration, law.Fs @ s + law.Fq @ q + law.Fv @ v + law.Fr @ r])


def torque_of(
    law: DriveLaw, q: np.ndarray, v: np.ndarray, s: np.ndarray, r: np.ndarray
) -> np.ndarray:
    """The drive's torque (nj,), without its limits."""
    return law.R @ r - law.P @ q - law.V @ v - law.S @ s


def jacobian(function, x: np.ndarray, step: float = 1e-3) -> np.ndarray:  # type: ignore[no-untyped-def]
    """df/dx by central differences of fourth order."""
    columns = []
    for i in range(len(x)):
        e = np.zeros(len(x))
        e[i] = step
        near, far = function(x + e) - function(x - e), function(x + 2 * e) - function(x - 2 * e)
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.array(columns).T


def refusal(action: Callable[[], object]) -> str:
    """The one line with which it is refused."""
    with pytest.raises(InputError) as caught:
        action()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def fit_percent(y: np.ndarray, yhat: np.ndarray) -> float:
    """FIT of all channels (N, k) together, design section 2."""
    miss, spread = np.linalg.norm(y - yhat), np.linalg.norm(y - y.mean(axis=0))
    return 100.0 * max(1.0 - float(miss / spread), 0.0)


def rms(x: np.ndarray | Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


def relative_to_largest(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference relative to the largest entry of b."""
    return float(np.abs(a - b).max() / np.abs(b).max())


def run_many_extrapolated(jobs: Sequence[Job], substeps: int, workers: int = 1) -> list[Trajectory]:
    """Two passes of each job and their extrapolation, with a fixed number of steps, so that the
    error varies smoothly with the parameters."""
    fine, coarse = passes(jobs, (max(substeps, 2), max(substeps // 2, 1)), workers)
    return [
        finished(job, extrapolated(a, b, job.numbers.law.limit))
        for a, b, job in zip(coarse, fine, jobs, strict=True)
    ]


def simulate_fixed(model: Model, numbers: Numbers, task: Task, substeps: int) -> Trajectory:
    """`run_many_extrapolated` of one."""
    return run_many_extrapolated([Job(model, numbers, task)], substeps)[0]
