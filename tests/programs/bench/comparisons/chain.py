"""A simulation by default against a chain of rigid bodies whose tip is as near to a beam's."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import NOISE_SHARE, Simulated, simulate_within
from tests.helpers import looped, with_modes
from tests.programs.bench.case import GAINS
from tests.programs.bench.row import FULL, Row, Size, least_seconds, seconds

SLENDER = 1e-3
"""Share of its transverse inertia that a body has about its axis; MuJoCo refuses none."""

UNSTABLE = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC")


@dataclass(frozen=True)
class Chain:
    """How the arm is cut: `hinges` per segment, `steps` of the engine per sample."""

    hinges: int
    steps: int

    def __str__(self) -> str:
        return f"{self.hinges} hinges per segment, {self.steps} steps per sample"


class ChainRun:
    """One task made ready for the engine; calling it runs the whole motion."""

    def __init__(self, model: Model, gains: list[float], task: Task, cut: Chain) -> None:
        import mujoco

        mujoco.set_mju_user_warning(lambda _: None)  # unstable settings are tried on purpose
        self.engine, self.task, self.steps = mujoco, task, cut.steps
        text = _mjcf(model, gains, cut.hinges, task.sample_time / cut.steps)
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)

    def __call__(self) -> np.ndarray:
        """The tip (N, 2) in m; not a number where the motion was unstable."""
        engine, model, data, task = self.engine, self.model, self.data, self.task
        engine.mj_resetData(model, data)
        for k in range(task.references.shape[1]):
            data.qpos[model.joint(f"motor{k}").qposadr[0]] = task.start[k]
        tip, site = np.empty((len(task.time), 2)), model.site("tip").id
        for t, rates in enumerate(task.references):
            data.ctrl[:] = rates
            engine.mj_kinematics(model, data)
            tip[t] = data.site_xpos[site, :2]
            engine.mj_step(model, data, self.steps)
        kinds = [getattr(engine.mjtWarning, name) for name in UNSTABLE]
        return np.full_like(tip, np.nan) if any(data.warning[k].number for k in kinds) else tip


def _mjcf(model: Model, gains: list[float], hinges: int, step: float) -> str:
    """The model's text; `step` in s."""
    bodies = "".join(_bodies(model, hinges))
    drives = "".join(f'<velocity joint="motor{k}" kv="{g!r}"/>' for k, g in enumerate(gains))
    return f"""<mujoco><compiler angle="radian"/>
<option timestep="{step!r}" integrator="implicitfast" gravity="0 0 0" jacobian="dense">
<flag contact="disable" constraint="disable"/></option>
<worldbody>{bodies}<site name="tip" pos="{_pieces(model, -1, hinges)[-1]!r} 0 0"/>
{"</body>" * bodies.count("<body")}</worldbody><actuator>{drives}</actuator></mujoco>"""


def _pieces(model: Model, segment: int, hinges: int) -> list[float]:
    """Lengths in m of the rigid bodies."""
    piece = model.arm.segments[segment].length / hinges
    return [piece / 2.0, *([piece] * (hinges - 1)), piece / 2.0]


def _bodies(model: Model, hinges: int) -> Iterator[str]:
    """Opened, not closed: each body hangs on the one before."""
    place = 0.0
    for k, segment in enumerate(model.arm.segments):
        stiffness = segment.bending_stiffness * hinges / segment.length
        for i, length in enumerate(_pieces(model, k, hinges)):
            mass = segment.mass * length / segment.length
            across = mass * length**2 / 12.0
            what = f'stiffness="{stiffness!r}"' if i else f'name="motor{k}"'
            yield (
                f'<body pos="{place!r} 0 0"><joint axis="0 0 1" {what}/>'
                f'<inertial pos="{length / 2.0!r} 0 0" mass="{mass!r}" '
                f'diaginertia="{SLENDER * across!r} {across!r} {across!r}"/>'
            )
            place = length


TARGETS = {2: 4.0, 3: 10.0}
"""Modes per segment -> times faster."""

CAMERA = 3e-5
"""m, the noise of a good one."""

HINGES = (2, 3, 4, 6, 8, 10, 12, 14, 16)
STEPS = (1, 2, 4, 8, 16, 20, 24, 32, 48)
BEAM = ((10, 64), (20, 192))
"""Hinges and steps of two chains of which the beam is extrapolated; the error of the first falls
with the square of the hinges."""

REPEATS, PEER_REPEATS = 9, 3
RIVAL = "chain of rigid bodies in MuJoCo, as exact"


def rows(size: Size) -> list[Row]:
    """With two and three modes per segment."""
    if find_spec("mujoco") is None:
        model = looped(with_modes(2, 2))
        task = _task(model, size)
        ours = least_seconds(lambda: _simulated(model, task), REPEATS)
        what, note = _question(2, size), "mujoco is not installed"
        return [Row(what, ours, value="skipped", note=note, rival=RIVAL)]
    model = looped(with_modes(2, 2))
    truth = _beam(model, _task(model, size))
    return [_row(modes, truth, size) for modes in TARGETS]


def _task(model: Model, size: Size) -> Task:
    spec = SimulateSpec(theta2=np.pi / 2.0, seconds=size.record, seed=1)
    return make_task(model, spec, "bench")[0]


def _simulated(model: Model, task: Task) -> Simulated:
    """As a user has it whose camera is a good one."""
    return simulate_within(model, model.numbers(), task, NOISE_SHARE * CAMERA)


def _beam(model: Model, task: Task) -> np.ndarray:
    """The tip (N, 2) of the converged chain."""
    coarse, fine = (ChainRun(model, GAINS, task, Chain(*cut))() for cut in BEAM)
    return np.asarray((4.0 * fine - coarse) / 3.0)


def _distance(tip: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square in m; infinite where the motion was unstable."""
    found = float(np.sqrt(np.mean(np.sum((tip - truth) ** 2, axis=1))))
    return found if np.isfinite(found) else np.inf


def _row(modes: int, truth: np.ndarray, size: Size) -> Row:
    model = looped(with_modes(modes, modes))
    task = _task(model, size)
    found = _simulated(model, task)
    true = _distance(found.trajectory.tip()[0], truth)
    ours = least_seconds(lambda: _simulated(model, task), REPEATS)
    peer, cut, theirs = _quickest(model, task, truth, true)
    note = (
        f"a chain is another model: what is compared is the tip's distance to a converged beam; "
        f"{found.substeps} steps per sample; peer stepped from "
        f"Python: {cut}, {len(task.time) * cut.steps / peer:.0f} steps/s"
    )
    target = TARGETS[modes] if size == FULL else None
    errors = f"{true:.1e} / {theirs:.1e} m rms"
    return Row(_question(modes, size), ours, peer, target, None, "", note, RIVAL, errors)


def _question(modes: int, size: Size) -> str:
    return f"simulation by default, {modes} modes, {size.record:g} s"


def _quickest(
    model: Model, task: Task, truth: np.ndarray, error: float
) -> tuple[float, Chain, float]:
    """Of the quickest chain that is at least as near to the beam: seconds, chain, distance in m."""
    found: list[tuple[float, Chain, float]] = []
    for hinges in HINGES:
        for steps in STEPS:
            run = ChainRun(model, GAINS, task, Chain(hinges, steps))
            if (near := _distance(run(), truth)) <= error:
                found.append((least_seconds(run, PEER_REPEATS), Chain(hinges, steps), near))
                break
        if found and seconds(run) > 2.0 * found[0][0]:
            break  # more hinges only take longer
    return min(found, key=lambda each: each[0])
