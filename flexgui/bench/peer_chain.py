"""The arm in MuJoCo: each segment a chain of rigid bodies on elastic hinges.

A uniform beam is cut into equal pieces; each bends in a hinge at its middle, of stiffness
EI pieces / length. The first and the last body have half the length.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.model import Model
from core.simulate.motion import Task

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
