"""Rigs whose torque is recorded, as plain files: no filter and no noise is stated.

A computer moves each joint along a smooth motion with the torques of a rigid model that is ten per
cent off and a feedback from the counting encoders; every torque is held for a sample. The rigid
arms are integrated here, the flexible ones are chains of rigid bodies in MuJoCo.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numba import njit

from tests.mujoco.chain import Beam, Motor, Plant, mjcf

WRONG_MASS = 0.9
"""Stated over true mass: what a data sheet says."""
WRONG_STIFFNESS = (0.7, 1.3)
"""The same of bending stiffness, per segment."""
SWINGS = (0.3, 0.7, 1.1, 1.9, 2.9)
"""Hz, of the sines that a joint's motion is made of."""
FEEDBACK = 8.0
"""rad/s, of each joint's loop, well damped."""
SUBSTEPS = 8
"""Of an integration within a sample: friction turns round within about a millisecond."""
STEP = 20e-6
"""s, of the engine: as for the other chains."""
SLIDING = 2e-3
"""rad/s or m/s, of a joint whose dry friction is at 76 % of its level."""


@dataclass(frozen=True)
class TorqueRig:
    """At neutral: uniform rigid links in a row, or one slide, with nothing but inertia."""

    masses: tuple[float, ...]
    """kg, one per segment."""
    lengths: tuple[float, ...]
    """m"""
    stiffness: tuple[float, ...] = ()
    """N m², of each segment; none: rigid."""
    slide: bool = False
    rate: float = 1000.0
    """Hz"""
    seconds: float = 3.0
    bits: int = 18
    """Counts of an encoder are 2 π / 2^bits rad, or 1 m / 2^bits on a slide."""
    viscous: tuple[float, ...] = ()
    """N m s/rad or N s/m per joint."""
    coulomb: tuple[float, ...] = ()
    """N m or N per joint."""
    payload: float = 0.0
    """kg, a point at the tip."""
    hub_inertia: float = 0.0
    """kg m² of each motor, which is stated."""
    disturbance: tuple[float, ...] = ()
    """N m or N with which something nearby shakes each joint: no effect of the catalogue."""
    disturbance_hz: float = 0.0
    recordings: int = 2

    @property
    def joints(self) -> int:
        return len(self.masses)

    @property
    def step(self) -> float:
        """rad or m, of an encoder."""
        return (1.0 if self.slide else 2.0 * np.pi) / 2.0**self.bits

    @property
    def constants(self) -> np.ndarray:
        """What `_rate` takes: inertias, coupling, frictions and what disturbs each joint."""
        m, length, p = self.masses, self.lengths, self.payload
        two = self.joints == 2
        if self.slide:
            first, own, cross = m[0] + p, 0.0, 0.0
        elif not two:
            first, own, cross = (m[0] / 3.0 + p) * length[0] ** 2, 0.0, 0.0
        else:
            first = m[0] * length[0] ** 2 / 3.0 + (m[1] + p) * length[0] ** 2
            own, cross = (m[1] / 3.0 + p) * length[1] ** 2, (m[1] / 2.0 + p) * length[0] * length[1]
        none = (0.0,) * self.joints
        each = [x or none for x in (self.viscous, self.coulomb, self.disturbance)]
        return np.array([first, own, cross, self.disturbance_hz, *np.ravel(each)])


@njit(cache=True)
def _rate(n, t, y, u, e):  # type: ignore[no-untyped-def]
    """Of the state [q, q'] of n rigid links: M q'' + h = u - friction + what shakes them."""
    first, own, cross, hz = e[0], e[1], e[2], e[3]
    pushed = np.empty(n)
    for k in range(n):
        v = y[n + k]
        pushed[k] = u[k] - e[4 + k] * v - e[4 + n + k] * np.tanh(v / SLIDING)
        pushed[k] += e[4 + 2 * n + k] * np.sin(2.0 * np.pi * hz * t)
    found = np.empty(2 * n)
    found[:n] = y[n:]
    if n == 1:
        found[1] = pushed[0] / first
        return found
    c, s = np.cos(y[1]), np.sin(y[1])
    pushed[0] += cross * s * y[3] * (2.0 * y[2] + y[3])
    pushed[1] -= cross * s * y[2] ** 2
    a, b = first + own + 2.0 * cross * c, own + cross * c
    found[2] = (own * pushed[0] - b * pushed[1]) / (a * own - b * b)
    found[3] = (a * pushed[1] - b * pushed[0]) / (a * own - b * b)
    return found


@njit(cache=True)
def _advanced(n, t, y, u, e, h):  # type: ignore[no-untyped-def]
    """The state SUBSTEPS steps of length h later, by fourth-order Runge-Kutta."""
    for _ in range(SUBSTEPS):
        a = _rate(n, t, y, u, e)
        b = _rate(n, t + h / 2, y + h / 2 * a, u, e)
        c = _rate(n, t + h / 2, y + h / 2 * b, u, e)
        d = _rate(n, t + h, y + h * c, u, e)
        y, t = y + h / 6 * (a + 2 * b + 2 * c + d), t + h
    return y


class _Integrated:
    """A rigid rig in motion; no camera looks at it."""

    def __init__(self, rig: TorqueRig, place: np.ndarray) -> None:
        self.rig, self.samples = rig, 0
        self.state = np.concatenate([place, np.zeros(rig.joints)])

    @property
    def place(self) -> np.ndarray:
        return self.state[: self.rig.joints]

    @property
    def tip(self) -> np.ndarray:
        return np.zeros(0)

    def advance(self, torque: np.ndarray) -> None:
        """By one sample, with the torque held."""
        dt, n = 1.0 / self.rig.rate, self.rig.joints
        at = self.samples * dt
        self.state = _advanced(n, at, self.state, torque, self.rig.constants, dt / SUBSTEPS)
        self.samples += 1


class _Chain:
    """A flexible rig in the engine; its camera sees the tip."""

    def __init__(self, rig: TorqueRig, place: np.ndarray) -> None:
        self.rig = rig
        beams = tuple(
            Beam(length, mass, EI, hinges=10)
            for length, mass, EI in zip(rig.lengths, rig.masses, rig.stiffness, strict=True)
        )
        viscous = rig.viscous or (0.0,) * rig.joints
        coulomb = rig.coulomb or (0.0,) * rig.joints
        motors = tuple(
            Motor(1.0, c, v, inertia=rig.hub_inertia) for v, c in zip(viscous, coulomb, strict=True)
        )
        text = mjcf(Plant(beams, motors, tip_mass=rig.payload), STEP)
        for k in range(rig.joints):
            text = text.replace(
                f'<velocity name="drive{k + 1}" joint="motor{k + 1}" kv="1.0" />',
                f'<motor name="drive{k + 1}" joint="motor{k + 1}"/>',
            )
        assert "<velocity" not in text
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(f"motor{k + 1}") for k in range(rig.joints)]
        self._places = [int(j.qposadr[0]) for j in joints]
        self._site = self.model.site("tip").id
        self.data.qpos[self._places] = place
        mujoco.mj_forward(self.model, self.data)

    @property
    def place(self) -> np.ndarray:
        return np.array(self.data.qpos[self._places])

    @property
    def tip(self) -> np.ndarray:
        mujoco.mj_kinematics(self.model, self.data)
        return np.array(self.data.site_xpos[self._site, :2])

    def advance(self, torque: np.ndarray) -> None:
        """By one sample, with the torque held."""
        self.data.ctrl[:] = torque
        mujoco.mj_step(self.model, self.data, round(1.0 / self.rig.rate / STEP))


def _wanted(rig: TorqueRig, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place, speed and acceleration (N, joints) of a motion from rest."""
    t = np.arange(round(rig.seconds * rig.rate) + 1) / rig.rate
    begin = np.clip(t / 0.5, 0.0, 1.0)
    soft = begin**3 * (10.0 - 15.0 * begin + 6.0 * begin**2)
    reach = 0.1 if rig.slide else 0.5
    place = np.zeros((len(t), rig.joints))
    for k in range(rig.joints):
        for hz in SWINGS:
            place[:, k] += soft * np.sin(2 * np.pi * hz * t + rng.uniform(0.0, 6.28)) / (1.0 + hz)
    place *= reach / np.abs(place).max(axis=0)
    speed = np.gradient(place, 1.0 / rig.rate, axis=0)
    return place, speed, np.gradient(speed, 1.0 / rig.rate, axis=0)


def recorded(rig: TorqueRig, posture: Sequence[float], seed: int) -> dict[str, np.ndarray]:
    """One recording: column -> (N,)."""
    rng = np.random.default_rng(seed)
    place, speed, acceleration = _wanted(rig, rng)
    middle = np.array(posture, dtype=float)
    world = _Chain(rig, middle) if rig.stiffness else _Integrated(rig, middle)
    first, own, cross, *_ = rig.constants
    whole = np.array([first + own + 2.0 * cross * np.cos(middle[-1]) * (rig.joints > 1), own])
    inertia = WRONG_MASS * whole[: rig.joints] + rig.hub_inertia
    stiff, damping = FEEDBACK**2 * inertia, 2.0 * FEEDBACK * inertia
    rows, before = [], middle
    for i, (q, v, a) in enumerate(zip(place + middle, speed, acceleration, strict=True)):
        counts = world.place / rig.step + rng.normal(size=rig.joints)
        seen = rig.step * np.round(counts)
        rate = (seen - before) * rig.rate if i else np.zeros(rig.joints)
        torque = inertia * a + stiff * (q - seen) + damping * (v - rate)
        torque, before = np.round(torque, 6), seen
        tip = world.tip + 3e-5 * rng.normal(size=world.tip.shape)
        rows.append(np.concatenate([[i / rig.rate], torque, seen, tip]))
        world.advance(torque)
    return dict(zip(columns(rig), np.array(rows).T, strict=True))


def columns(rig: TorqueRig) -> list[str]:
    """Headers of a recording."""
    joints = range(1, rig.joints + 1)
    camera = ["z1", "z2"] if rig.stiffness else []
    return ["t", *(f"u{k}" for k in joints), *(f"theta{k}" for k in joints), *camera]


def scenario_text(rig: TorqueRig) -> str:
    """What a newcomer states: arm, drive, files and what is to be estimated."""
    text = 'title = "Recorded torques"\n\n'
    for k in range(rig.joints):
        mass = rig.masses[k] * (1.0 if rig.stiffness else WRONG_MASS)
        text += f"[[arm.segments]]\nlength = {rig.lengths[k]!r}\nmass = {mass!r}\n"
        if rig.stiffness:
            text += f"EI = {rig.stiffness[k] * WRONG_STIFFNESS[k]!r}\nmodes = 2\n"
            text += f"hub_inertia = {rig.hub_inertia!r}\n"
        else:
            text += "modes = 0\n"
        text += 'joint = "prismatic"\n\n' if rig.slide else "\n"
    text += '[drive]\nkind = "torque"\n\n[identify]\nparameters = '
    letter = "EI" if rig.stiffness else "m"
    text += str([f"{letter}{k + 1}" for k in range(rig.joints)]).replace("'", '"') + "\n"
    text += "\n[diagnose]\nmax_effects = 4\n"
    for i in range(rig.recordings):
        text += f'\n[[recordings]]\nfile = "r{i + 1}.csv"\n'
    return text


def written(rig: TorqueRig, seed: int, folder: Path) -> Path:
    """Recordings and scenario as files; the scenario's path."""
    for i in range(rig.recordings):
        posture = [0.0] if rig.joints == 1 else [0.0, 0.7 + 0.8 * i]
        table = recorded(rig, posture, seed + i)
        np.savetxt(
            folder / f"r{i + 1}.csv", np.column_stack(list(table.values())), "%.9g", ",",
            header=",".join(table), comments="",
        )  # fmt: skip
    path = folder / "scenario.toml"
    path.write_text(scenario_text(rig), encoding="utf-8")
    return path
