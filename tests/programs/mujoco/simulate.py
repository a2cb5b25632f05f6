"""Running the chain and looking at it: exact samples, without the noise of the instruments."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from tests.programs.mujoco.chain import Plant, mjcf
from tests.programs.mujoco.excitation import SAMPLE


@dataclass(frozen=True)
class Motion:
    """What happened at each sample: rad, rad/s, m and N m; rows are samples."""

    reference: np.ndarray
    angles: np.ndarray
    tip: np.ndarray
    torque: np.ndarray


def run(plant: Plant, theta2: float, reference: np.ndarray, step: float) -> Motion:
    """Start straight and at rest at [0, theta2] in rad, hold each row of `reference` one sample.

    Feedback, friction and limits are evaluated at every step of the integrator; `step` in s is
    rounded so that a sample is a whole number of them.
    """
    steps = round(SAMPLE / step)
    model = mujoco.MjModel.from_xml_string(mjcf(plant, SAMPLE / steps))
    data = mujoco.MjData(model)
    joints = [model.joint(f"motor{n}").qposadr[0] for n in (1, 2)]
    data.qpos[joints[1]] = theta2
    angles, tip, torque = (np.empty((len(reference), 2)) for _ in range(3))
    for i, rates in enumerate(reference):
        data.ctrl[:] = rates
        mujoco.mj_forward(model, data)
        angles[i], tip[i] = data.qpos[joints], data.site("tip").xpos[:2]
        torque[i] = data.actuator_force
        mujoco.mj_step(model, data, steps)
        _check(data)
    return Motion(reference, angles, delayed(tip, plant.camera_delay), torque)


def _check(data: mujoco.MjData) -> None:
    """The engine restarts an unstable motion with no more than a line in its log."""
    kinds = mujoco.mjtWarning
    for kind in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC):
        if data.warning[kind].number:
            raise ArithmeticError(f"the motion is unstable at {data.time:g} s; take a finer step")


def delayed(tip: np.ndarray, delay: float, sample_time: float = SAMPLE) -> np.ndarray:
    """What a camera reports that is `delay` s late; the arm was at rest before the start."""
    late = round(delay / sample_time)
    if abs(late * sample_time - delay) > 1e-9:
        raise ValueError(f"a delay of {delay} s is no whole number of samples of {sample_time} s")
    return tip[np.maximum(np.arange(len(tip)) - late, 0)]
