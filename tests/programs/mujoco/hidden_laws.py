"""Laws that no catalogue has, hidden in an arm of the engine: torques of the true state.

Every law is a plain function of where a joint is, how fast it turns, the time and, for one, a share
that a rubbing surface remembers. It is evaluated before every step of the engine and pushes one
joint; what the engine applied is what is written as the truth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from tests.programs.mujoco.chain import POINT, THICKNESS

TURNING = 5e-3
"""rad/s, of a joint whose dry friction is at 76 % of its level: a lighter joint than those here, or
a longer step, and an explicit friction would chatter."""
HYSTERESIS = "hysteresis"


@dataclass(frozen=True)
class Along:
    """What a law may depend on, at one instant or as arrays over many."""

    place: Any
    """rad, of the joint whose angle the law reads."""
    rate: Any
    """rad/s, of the joint that it pushes."""
    time: Any
    """s, since the recording began."""
    share: Any = 0.0
    """-1 to 1, what a rubbing surface gives of its level."""
    other_rate: Any = 0.0
    """rad/s, of the joint whose angle the law reads."""
    load: Any = 0.0
    """N m, of the drive of the joint that it pushes."""
    column: Any = 0.0
    """A further signal that is recorded, such as a temperature."""

    @property
    def direction(self) -> Any:
        """-1 to 1: the sign of the rate, turning within `TURNING`."""
        return np.tanh(self.rate / TURNING)


def range_friction(on: Along, size: float, low: float, high: float, edge: float) -> Any:
    """Dry friction of `size` N m between two angles, which sets in over `edge` rad."""
    inside = np.tanh((on.place - low) / edge) - np.tanh((on.place - high) / edge)
    return -0.5 * size * inside * on.direction


def cogging(on: Along, size: float, order: float, second: float, third: float, start: float) -> Any:
    """`order` waves per turn of `size` N m, and shares of their second and third harmonics."""
    wave = order * on.place + start
    return size * (
        np.sin(wave) + second * np.sin(2.0 * wave + 1.0) + third * np.sin(3.0 * wave + 2.5)
    )


def other_joint(on: Along, size: float, middle: float, width: float) -> Any:
    """A bump of `size` N m over the angle of the other joint: a hose that is squeezed there."""
    return size * np.exp(-(((on.place - middle) / width) ** 2))


def dead_zone_spring(on: Along, size: float, middle: float, half: float) -> Any:
    """A spring of `size` N m/rad beyond `half` rad on either side of a place."""
    away = on.place - middle
    return -size * (away - np.clip(away, -half, half))


def quadratic_friction(on: Along, size: float) -> Any:
    """`size` N m s²/rad²: a fan, or oil that is churned."""
    return -size * on.rate * np.abs(on.rate)


def settling_friction(on: Along, size: float, tau: float) -> Any:
    """Dry friction that rises to `size` N m with the time constant `tau` in s."""
    return size * np.expm1(-on.time / tau) * on.direction


def growing_friction(on: Along, size: float) -> Any:
    """Dry friction that rises by `size` N m/s from nothing."""
    return -size * on.time * on.direction


def cable(on: Along, size: float, start: float, side: float) -> Any:
    """Pulls back with `size` N m/rad beyond an angle, on the side +1 or -1 of it alone."""
    return -side * size * np.maximum(side * (on.place - start), 0.0)


def hysteresis(on: Along, size: float, way: float, power: float) -> Any:
    """Friction of `size` N m whose direction turns over a way: see `slipped`."""
    return -size * on.share


def place_viscous(on: Along, size: float, middle: float, width: float) -> Any:
    """Viscous friction that grows along the way from nothing to 2 `size` N m s/rad."""
    return -size * (1.0 + np.tanh((on.place - middle) / width)) * on.rate


def exponential_spring(on: Along, size: float, start: float, width: float, side: float) -> Any:
    """Pushes back from an end stop of rubber: `size` N m at `start`, e times that `width` on."""
    return -side * size * np.exp(side * (on.place - start) / width)


def directed_friction(
    on: Along, size: float, order: float, start: float, depth: float, back: float
) -> Any:
    """Dry friction: forwards `size` N m with waves over the place, backwards a share of it."""
    forwards = 1.0 + depth * np.sin(order * on.place + start)
    return -size * np.where(on.rate > 0.0, forwards, back) * on.direction


def speed_power(on: Along, size: float, power: float, turns: float) -> Any:
    """`size` N m times a power of the speed in rad/s, against the motion where it `turns` (1) with
    it, else (0) always backwards."""
    sign = np.sign(on.rate) if turns else 1.0
    return -size * np.abs(on.rate) ** power * sign


def place_bump(on: Along, size: float, middle: float, width: float) -> Any:
    """A bump of `size` N m over the joint's own angle."""
    return size * np.exp(-(((on.place - middle) / width) ** 2))


def falling_friction(on: Along, size: float, pace: float) -> Any:
    """Friction that rises to `size` N m at a `pace` in rad/s and falls beyond it."""
    return -size * on.rate / pace * np.exp(1.0 - np.abs(on.rate) / pace)


def speeds_product(on: Along, size: float) -> Any:
    """`size` N m s²/rad² times the speeds of both joints."""
    return size * on.rate * on.other_rate


def damping_over_other(on: Along, size: float, middle: float) -> Any:
    """Damping that grows with the square of the other joint's angle from a place on."""
    return -size * (on.place - middle) ** 2 * on.rate


def load_damping(on: Along, size: float) -> Any:
    """Damping in proportion to the drive's load, `size` s/rad."""
    return -size * np.abs(on.load) * on.rate


def column_torque(on: Along, size: float) -> Any:
    """A torque in proportion to a further column."""
    return size * on.column


def column_friction(on: Along, size: float) -> Any:
    """Dry friction in proportion to a further column."""
    return -size * on.column * on.direction


def camera_bend(reading: np.ndarray, size: float, length: float, power: float) -> np.ndarray:
    """m that are added to a reading in m: a lens whose scale changes by `size` over `length`."""
    return size * reading * (reading / length) ** (power - 1.0)


TORQUES: Mapping[str, Callable[..., Any]] = {
    law.__name__: law
    for law in (
        range_friction, cogging, other_joint, dead_zone_spring, quadratic_friction,
        settling_friction, growing_friction, cable, hysteresis, place_viscous, exponential_spring,
        directed_friction,
    )
}  # fmt: skip

FURTHER: Mapping[str, Callable[..., Any]] = {
    law.__name__: law
    for law in (
        speed_power, place_bump, falling_friction, speeds_product, damping_over_other, load_damping,
        column_torque, column_friction,
    )
}  # fmt: skip


def slipped(share: float, rate: float, step: float, way: float, power: float) -> float:
    """The share a `step` in s later: it turns round over about `way` rad.

    With the power 1 this is Dahl's model, which the catalogue has; with 0 a spring that slips, with
    2 a surface that slips ever later.
    """
    moved = step * rate / way
    left = max(1.0 - share * float(np.sign(rate)), 0.0)
    return float(np.clip(share + moved * left**power, -1.0, 1.0))


@dataclass(frozen=True)
class Law:
    """One law at one joint."""

    form: str
    target: int
    """The joint that is pushed, from 0."""
    carrier: int
    """The joint whose angle it reads, from 0."""
    numbers: Mapping[str, float]

    def torque(
        self, angles: Any, rates: Any, time: Any, share: Any = 0.0, load: Any = 0.0,
        column: Any = 0.0,
    ) -> Any:  # fmt: skip
        """N m that it adds, of angles and rates (joints,) or, over many instants, (N, joints)."""
        on = Along(
            angles[..., self.carrier], rates[..., self.target], time, share,
            rates[..., self.carrier], load, column,
        )  # fmt: skip
        return {**TORQUES, **FURTHER}[self.form](on, **self.numbers)

    def after(self, share: float, rate: float, step: float) -> float:
        """What its surface remembers a `step` in s later, at this rate of the target in rad/s."""
        if self.form != HYSTERESIS:
            return 0.0
        return slipped(share, rate, step, self.numbers["way"], self.numbers["power"])


def rigid_text(masses: tuple[float, ...], lengths: tuple[float, ...], step: float) -> str:
    """MJCF of slender rods in a row on motors: kg, m and s; joints motor1, ..., site tip."""
    bodies, place = "", 0.0
    for n, (mass, length) in enumerate(zip(masses, lengths, strict=True), 1):
        across = mass * length**2 / 12.0
        bodies += (
            f'<body pos="{place!r} 0 0"><joint name="motor{n}" axis="0 0 1"/>'
            f'<inertial pos="{length / 2.0!r} 0 0" mass="{mass!r}" '
            f'diaginertia="{THICKNESS * across + POINT!r} {across!r} {across!r}"/>'
        )
        place = length
    ends = f'<site name="tip" pos="{place!r} 0 0"/>' + "</body>" * len(masses)
    motors = "".join(f'<motor joint="motor{n + 1}"/>' for n in range(len(masses)))
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{step!r}" gravity="0 0 0" '
        f'integrator="implicitfast"/><worldbody>{bodies}{ends}</worldbody>'
        f"<actuator>{motors}</actuator></mujoco>"
    )


@dataclass(frozen=True)
class Instant:
    """The true state at a sample, and the torques from there on: rad, rad/s, m, N m."""

    time: float
    angles: np.ndarray
    rates: np.ndarray
    tip: np.ndarray
    share: float
    law: np.ndarray
    """(joints,) as the engine applied it."""
    drive: np.ndarray


@dataclass(frozen=True)
class Push:
    """A force at the tip for a while, such as of somebody's hand."""

    start: float
    """s"""
    seconds: float
    force: tuple[float, float]
    """N, in the plane"""


class Machine:
    """An arm in the engine, at rest at first, with a law or none in its step loop."""

    def __init__(
        self, text: str, posture: np.ndarray, sample_time: float, law: Law | None,
        column: Callable[[float], float] = lambda _: 0.0, push: Push | None = None,
    ) -> None:  # fmt: skip
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data, self.law, self.share = mujoco.MjData(self.model), law, 0.0
        self._column, self._push = column, push
        self.steps = round(sample_time / self.model.opt.timestep)
        joints = [self.model.joint(f"motor{k + 1}") for k in range(len(posture))]
        self._places = np.array([int(j.qposadr[0]) for j in joints])
        self._dofs = np.array([int(j.dofadr[0]) for j in joints])
        self._tip = self.model.site("tip").id
        self.data.qpos[self._places] = posture

    @property
    def angles(self) -> np.ndarray:
        return np.array(self.data.qpos[self._places])

    def sample(self, control: np.ndarray) -> Instant:
        """Goes on by one sample with the motors' torques (or rates that they follow) held."""
        data = self.data
        mujoco.mj_kinematics(self.model, data)
        data.ctrl[:] = control
        time, angles, share = float(data.time), self.angles, self.share
        rates, tip = data.qvel[self._dofs].copy(), data.site_xpos[self._tip, :2].copy()
        self._step()
        applied = data.qfrc_applied[self._dofs].copy()
        found = Instant(time, angles, rates, tip, share, applied, data.actuator_force.copy())
        if self.law is None and self._push is None:
            mujoco.mj_step(self.model, data, self.steps - 1)
        else:
            for _ in range(self.steps - 1):
                self._step()
        assert not any(w.number for w in data.warning), "the engine diverged"
        return found

    def _step(self) -> None:
        law, data = self.law, self.data
        if law is not None:
            rates, h = data.qvel[self._dofs], self.model.opt.timestep
            load = data.actuator_force[law.target]
            torque = law.torque(
                data.qpos[self._places], rates, data.time, self.share, load,
                self._column(data.time),
            )  # fmt: skip
            data.qfrc_applied[self._dofs[law.target]] = torque
            self.share = law.after(self.share, float(rates[law.target]), h)
        self._pushed()
        mujoco.mj_step(self.model, data)

    def _pushed(self) -> None:
        push, data = self._push, self.data
        if push is None:
            return
        data.qfrc_applied[:] = 0.0
        if push.start <= data.time < push.start + push.seconds:
            force, none = np.array([*push.force, 0.0]), np.zeros(3)
            point, body = data.site_xpos[self._tip], self.model.site_bodyid[self._tip]
            mujoco.mj_applyFT(self.model, data, force, none, point, body, data.qfrc_applied)
