"""Running a rig in the engine, and what its instruments report."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from tests.programs.mujoco.excitation import SAMPLE
from tests.programs.mujoco.simulate import delayed
from tests.programs.mujoco.wide_rig import Rig, text

TEETH_TIME = 2e-5
"""s, retardation time of teeth that meet."""
FINEST = 8
"""Parts of a step."""


class UnstableError(ArithmeticError):
    """The engine's step is too coarse."""


@dataclass(frozen=True)
class Motion:
    """Without noise, rows are samples: rad/s, rad, m."""

    reference: np.ndarray
    angles: np.ndarray
    tip: np.ndarray


class World:
    """One rig in the engine, and what acts between two of its steps."""

    def __init__(self, rig: Rig, step: float, sample_time: float = SAMPLE) -> None:
        self.rig, self.step, self.sample_time = rig, step, sample_time
        self.model = mujoco.MjModel.from_xml_string(text(rig, step))
        self.data = mujoco.MjData(self.model)
        motors, count = rig.plant.motors, len(rig.plant.motors)
        joints = [self.model.joint(f"motor{n + 1}") for n in range(count)]
        self.places = np.array([j.qposadr[0] for j in joints])
        self.dofs = np.array([j.dofadr[0] for j in joints])
        self.gains = np.array([m.gain for m in motors])
        self.limits = np.array([np.inf if m.limit is None else m.limit for m in motors])
        self.stiffness = np.array([m.spring or 0.0 for m in motors])
        self.gaps, self.cubic = np.array(rig.gaps), np.array(rig.cubic)
        if any(rig.gaps):
            teeth = [self.model.joint(f"teeth{n + 1}") for n in range(count)]
            self.teeth = np.array([j.dofadr[0] for j in teeth])
        self.tip = self.model.site("tip").id
        self.force, self.seen = np.zeros(count), np.zeros(2)

    def sample(self, reference: np.ndarray) -> None:
        """Goes on by one sample with the loops' references held."""
        steps = round(self.sample_time / self.step)
        if self.rig.plain:
            self.data.ctrl[:] = reference
            mujoco.mj_step(self.model, self.data, steps)
        else:
            for _ in range(steps):
                self._act(reference)
                mujoco.mj_step(self.model, self.data)
        kinds = mujoco.mjtWarning
        for kind in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC):
            if self.data.warning[kind].number:
                raise UnstableError(f"the motion is unstable at {self.data.time:g} s")

    def _act(self, reference: np.ndarray) -> None:
        """What the engine is told before a step."""
        rig, data = self.rig, self.data
        rates, count = data.qvel[self.dofs], len(self.dofs)
        asked = np.clip(self.gains * (reference - rates), -self.limits, self.limits)
        self.force = asked if not rig.lag else self._lagged(asked)
        data.ctrl[:count] = self.force if rig.torque_driven else reference
        if any(rig.cubic):
            data.ctrl[count:] = -self.cubic * data.ten_length**3
        if rig.pushes:
            angles = data.qpos[self.places]
            data.qfrc_applied[self.dofs] = sum(p(angles, rates, self.force) for p in rig.pushes)
        if rig.friction is not None:
            angles = data.qpos[self.places]
            self.model.dof_frictionloss[self.dofs] = rig.friction(angles, rates, self.force)
        if any(rig.gaps):
            self._press()
        if rig.drag:
            self._drag()
        if rig.camera_lag:
            share = -np.expm1(-self.step / rig.camera_lag)
            self.seen += share * (data.site_xpos[self.tip, :2] - self.seen)

    def _lagged(self, asked: np.ndarray) -> np.ndarray:
        return self.force - np.expm1(-self.step / self.rig.lag) * (asked - self.force)

    def _press(self) -> None:
        """Teeth push where they touch, and never pull."""
        twist, rate = self.data.qpos[self.teeth], self.data.qvel[self.teeth]
        pressed = twist - np.clip(twist, -self.gaps, self.gaps)
        push = self.stiffness * (pressed + TEETH_TIME * rate)
        self.data.qfrc_applied[self.teeth] = -np.where(push * pressed > 0.0, push, 0.0)

    def _drag(self) -> None:
        found = np.zeros(6)
        mujoco.mj_objectVelocity(
            self.model, self.data, mujoco.mjtObj.mjOBJ_SITE, self.tip, found, 0
        )
        speed = found[3:5]
        self.data.xfrc_applied[-1, :2] = -self.rig.drag * np.hypot(*speed) * speed


def run(
    rig: Rig, posture: tuple[float, ...], reference: np.ndarray, step: float,
    sample_time: float = SAMPLE,
) -> Motion:  # fmt: skip
    """Starts straight and at rest at these joints' angles (rad); a rig that is unstable with a step
    of so many s, as teeth before a light link are, takes half of it.

    Raises:
        UnstableError: Where even `FINEST` parts of the step are too coarse.
    """
    for share in (1, 2, 4, FINEST):
        world = World(rig, sample_time / round(sample_time / step * share), sample_time)
        try:
            return _reported(rig, _moved(world, posture, reference), sample_time)
        except UnstableError as error:
            unstable = error
    raise unstable


def _moved(world: World, posture: tuple[float, ...], reference: np.ndarray) -> Motion:
    data = world.data
    data.qpos[world.places] = posture
    mujoco.mj_forward(world.model, data)
    world.seen = data.site_xpos[world.tip, :2].copy()
    angles, tip = np.empty(reference.shape), np.empty((len(reference), 2))
    for i, rates in enumerate(reference):
        mujoco.mj_kinematics(world.model, data)
        angles[i] = data.qpos[world.places]
        tip[i] = world.seen if world.rig.camera_lag else data.site_xpos[world.tip, :2]
        world.sample(rates)
    return Motion(reference, angles, tip)


def _reported(rig: Rig, motion: Motion, sample_time: float) -> Motion:
    c, s = np.cos(rig.camera_angle), np.sin(rig.camera_angle)
    tip = (1.0 + rig.camera_scale) * delayed(motion.tip, rig.plant.camera_delay, sample_time)
    offsets = np.array(rig.encoder_offsets) if any(rig.encoder_offsets) else 0.0
    return Motion(motion.reference, motion.angles + offsets, tip @ np.array([[c, s], [-s, c]]))
