"""Thirty arms of two bending links in the vertical plane, logged at 100 Hz as laboratories do.

A loop of 1 kHz moves the joints of a chain of rigid bodies in MuJoCo; every tenth sample is logged:
counting encoders, currents in steps, a strain gauge at the root of each link. The scenario states
arm and torque constants, and no noise; the stiffness is wrong by 30 %, the gauges' scale unknown.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import mujoco
import numpy as np

from tests.programs.mujoco.chain import Beam, Motor, Plant, mjcf
from tests.programs.sample.cases import NOT_JUDGEABLE, OUTSIDE, Case

RIGS = 30
HIDDEN = ("", "presliding_friction", "tip_payload", "viscous_friction", "hardly_moves", OUTSIDE)
LOOP_HZ, LOGGED = 1000.0, 10
"""The loop's rate, and every how many of its samples are logged."""
HINGES, ENGINE_STEP = 10, 4e-5
GRAVITY = 9.81
SECONDS = 12.0
STANDSTILL = 1.0
"""s, before the motion begins."""
SWINGS = (0.13, 0.31, 0.55, 0.9)
"""Hz, of the sines that a joint's motion is made of."""
FEEDBACK = 12.0
"""rad/s, of each joint's loop."""
STATED_STIFFNESS = (0.7, 1.3)
DISTANCE = 1.5e-3
"""m, of the gauges from the neutral fibre; nobody states it."""
OUTSIDE_HZ = 1.7
"""Of what shakes the joints of some rigs, which nobody lists."""


@dataclass(frozen=True)
class Rig:
    """One arm with its motors and sensors; at neutral nothing is hidden."""

    lengths: tuple[float, float]
    masses: tuple[float, float]
    stiffness: tuple[float, float]
    hubs: tuple[float, float] = (0.15, 0.05)
    """kg m², stated"""
    constants: tuple[float, float] = (8.0, 4.0)
    """N m/A, stated"""
    bits: int = 17
    current_step: float = 0.01
    """A"""
    current_noise: float = 0.02
    gauge_noise: float = 5e-7
    damping: float = 1e-3
    """s, of the links"""
    reach: float = 0.6
    """rad, of the joints"""
    payload: float = 0.0
    viscous: tuple[float, float] = (0.0, 0.0)
    coulomb: tuple[float, float] = (0.0, 0.0)
    presliding: float = 2e-3
    """rad, until dry friction has its level"""
    shaken: tuple[float, float] = (0.0, 0.0)
    """N m"""


def drawn(seed: int) -> tuple[Rig, str, dict[str, float]]:
    """A rig, what it hides, and the truth by name."""
    kind, rng = HIDDEN[seed % len(HIDDEN)], np.random.default_rng([89, seed])
    lengths = tuple(float(x) for x in rng.uniform(0.35, 0.55, 2).round(3))
    masses = tuple(float(x) for x in (rng.uniform(0.8, 1.6, 2) * (1.3, 0.7)).round(3))
    beyond = np.array([masses[1] + masses[0] / 3.0, masses[1] / 3.0 + 0.05])
    hz = rng.uniform(2.5, 5.0, 2) * (1.2, 1.8)
    stiff = (2.0 * np.pi * hz) ** 2 * beyond * np.array(lengths) ** 3 / 3.0
    stiffness = tuple(float(f"{x:.3g}") for x in stiff)
    rig = Rig(lengths, masses, stiffness, bits=int(rng.integers(14, 20)),
              current_noise=float(rng.uniform(0.005, 0.03)))  # fmt: skip
    torque = GRAVITY * np.array([masses[1] * (lengths[0] + lengths[1] / 2) + masses[0] * lengths[0]
                                 / 2, masses[1] * lengths[1] / 2])  # fmt: skip
    share = torque * rng.uniform(0.08, 0.25, 2)
    pair = lambda x: (float(f"{x[0]:.3g}"), float(f"{x[1]:.3g}"))  # noqa: E731
    truth = {f"EI{k + 1}": x for k, x in enumerate(stiffness)}
    if kind == "presliding_friction":
        rig = replace(rig, coulomb=pair(share))
        truth |= {f"fc{k + 1}": x for k, x in enumerate(rig.coulomb)}
    if kind == "viscous_friction":
        rig = replace(rig, viscous=pair(share / 1.5))
        truth |= {f"fv{k + 1}": x for k, x in enumerate(rig.viscous)}
    if kind == "tip_payload":
        rig = replace(rig, payload=float(round(rng.uniform(0.1, 0.3) * masses[1], 3)))
        truth["mt2"] = rig.payload
    if kind == "hardly_moves":
        rig = replace(rig, reach=float(rng.uniform(0.2, 2.0)) * 2 * np.pi / 2**rig.bits)
    if kind == OUTSIDE:
        rig = replace(rig, shaken=pair(share))
    return rig, kind, truth


class World:
    """The rig in the engine."""

    def __init__(self, rig: Rig, posture: np.ndarray) -> None:
        self.rig = rig
        beams = tuple(Beam(*x, HINGES) for x in zip(rig.lengths, rig.masses, rig.stiffness,
                                                    strict=True))  # fmt: skip
        motors = tuple(Motor(1.0, viscous=v, inertia=hub)
                       for v, hub in zip(rig.viscous, rig.hubs, strict=True))  # fmt: skip
        plant = Plant(beams, motors, rig.payload, (0.0, -GRAVITY), rig.damping)
        text = mjcf(plant, ENGINE_STEP)
        for k in (1, 2):
            before = f'<velocity name="drive{k}" joint="motor{k}" kv="1.0" />'
            assert before in text
            text = text.replace(before, f'<motor name="drive{k}" joint="motor{k}"/>')
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.motors = [int(self.model.joint(f"motor{k}").qposadr[0]) for k in (1, 2)]
        self.roots = [place + 1 for place in self.motors]
        self.data.qpos[self.motors] = posture
        self.slid = np.zeros(2)
        self._settle(posture)

    def _settle(self, posture: np.ndarray) -> None:
        """Bends the links as they hang, with the motors held."""
        free = [i for i in range(self.model.nv) if i not in self.motors]
        for _ in range(50):
            mujoco.mj_forward(self.model, self.data)
            stiff = self.model.jnt_stiffness[free]
            force = self.data.qfrc_passive[free] - self.data.qfrc_bias[free]
            self.data.qpos[free] += 0.5 * force / stiff
        mujoco.mj_forward(self.model, self.data)

    @property
    def held(self) -> np.ndarray:
        """(2,) N m that hold the motors now, at rest."""
        return np.array(self.data.qfrc_bias[self.motors])

    @property
    def place(self) -> np.ndarray:
        return np.array(self.data.qpos[self.motors])

    @property
    def strain(self) -> np.ndarray:
        """(2,) of gauges at the first hinges."""
        pieces = np.array(self.rig.lengths) / HINGES
        return -DISTANCE * np.array(self.data.qpos[self.roots]) / pieces

    def advance(self, torque: np.ndarray) -> None:
        """By one sample of the loop, with the torque held; dry friction after Dahl."""
        steps = round(1.0 / LOOP_HZ / ENGINE_STEP)
        if not any(self.rig.coulomb):
            self.data.ctrl[:] = torque + self._shaken()
            mujoco.mj_step(self.model, self.data, steps)
            return
        for _ in range(steps):
            v = self.data.qvel[self.motors]
            self.slid += ENGINE_STEP * v * (1.0 - np.sign(v) * self.slid / self.rig.presliding)
            self.slid = np.clip(self.slid, -self.rig.presliding, self.rig.presliding)
            friction = np.array(self.rig.coulomb) * self.slid / self.rig.presliding
            self.data.ctrl[:] = torque - friction
            mujoco.mj_step(self.model, self.data)

    def _shaken(self) -> np.ndarray:
        return np.array(self.rig.shaken) * np.sin(2.0 * np.pi * OUTSIDE_HZ * self.data.time)


def recorded(rig: Rig, posture: np.ndarray, seed: int) -> dict[str, np.ndarray]:
    """One recording: column -> (N,)."""
    rng = np.random.default_rng(seed)
    world, step = World(rig, posture), 2.0 * np.pi / 2.0**rig.bits
    wanted, inertia = _wanted(rig, posture, rng), _inertia(rig)
    before, integral, smooth, rows = world.place, world.held, np.zeros(2), []
    for i, q in enumerate(wanted):
        seen = step * np.round(world.place / step + 0.3 * rng.standard_normal(2))
        rate = 0.0 * seen if i == 0 else (seen - before) * LOOP_HZ
        smooth = 0.9 * smooth + 0.1 * rate
        speed = (wanted[min(i + 1, len(wanted) - 1)] - q) * LOOP_HZ
        integral = integral + 2.0 * FEEDBACK**3 * inertia * (q - seen) / LOOP_HZ
        torque = integral + inertia * (4.0 * FEEDBACK**2 * (q - seen)
                                       + 3.0 * FEEDBACK * (speed - smooth))  # fmt: skip
        torque, before = np.clip(torque, -200.0, 200.0), seen
        if i % LOGGED == 0:
            current = torque / rig.constants + rig.current_noise * rng.standard_normal(2)
            current = rig.current_step * np.round(current / rig.current_step)
            gauges = 1e6 * (world.strain + rig.gauge_noise * rng.standard_normal(2))
            rows.append([i / LOOP_HZ, *current, *seen, *gauges])
        world.advance(torque)
    assert np.all(np.isfinite(rows)), "the loop is unstable"
    return dict(zip(("t", "i1", "i2", "theta1", "theta2", "eps1", "eps2"), np.array(rows).T,
                    strict=True))  # fmt: skip


def _inertia(rig: Rig) -> np.ndarray:
    """(2,) kg m² of the joints, about."""
    (l1, l2), (m1, m2) = rig.lengths, rig.masses
    return np.array([m1 * l1**2 / 3 + m2 * (l1**2 + l2**2 / 3), m2 * l2**2 / 3]) + rig.hubs


def _wanted(rig: Rig, posture: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(N, 2) places of a motion from rest."""
    t = np.arange(round(SECONDS * LOOP_HZ)) / LOOP_HZ
    begin = np.clip((t - STANDSTILL) / 1.5, 0.0, 1.0)
    soft = begin**3 * (10.0 - 15.0 * begin + 6.0 * begin**2)
    sines = [
        sum(np.sin(2 * np.pi * hz * t + rng.uniform(0.0, 6.28)) / (1.0 + hz) for hz in SWINGS)
        for _ in range(2)
    ]
    moves = soft[:, None] * np.column_stack(sines)
    return np.asarray(posture + rig.reach * moves / np.abs(moves).max(axis=0))


def scenario_text(rig: Rig) -> str:
    """What a newcomer states."""
    text = 'title = "A rig at 100 Hz"\n\n[arm]\ngravity = [0.0, -9.81]\n\n'
    for length, mass, EI, hub, factor in zip(
        rig.lengths, rig.masses, rig.stiffness, rig.hubs, STATED_STIFFNESS, strict=True
    ):
        text += f"[[arm.segments]]\nlength = {length}\nmass = {mass}\nhub_inertia = {hub}\n"
        text += f"EI = {EI * factor:.6g}\nmodes = 2\n\n"
    text += f'[drive]\nkind = "torque"\ntorque_constants = {list(rig.constants)}\n\n'
    text += '[identify]\nparameters = ["EI1", "EI2", "tau1", "tau2"]\n\n'
    text += "[diagnose]\nmax_effects = 4\n\n"
    for k, length in enumerate(rig.lengths):
        text += f"[sensors.strain{k + 1}]\nplace = {length / HINGES / 2:.6g}\n\n"
    for i, role in enumerate(("estimate", "estimate", "validate")):
        text += f'[[recordings]]\nfile = "r{i + 1}.csv"\nrole = "{role}"\n'
        text += 'columns = { strain1 = "eps1 [um/m]", strain2 = "eps2 [um/m]" }\n\n'
    return text


def written(seed: int, folder: Path) -> Path:
    """Recordings and scenario as files; the scenario's path."""
    rig = drawn(seed)[0]
    for i in range(3):
        posture = np.array([0.5 + 0.5 * i, -0.9 + 0.6 * i])
        table = recorded(rig, posture, 100 * seed + i)
        np.savetxt(
            folder / f"r{i + 1}.csv", np.column_stack(list(table.values())), "%.7g", ",",
            header=",".join(table), comments="",
        )  # fmt: skip
    path = folder / "scenario.toml"
    path.write_text(scenario_text(rig), encoding="utf-8")
    return path


def cases() -> dict[str, Case]:
    """All by name."""
    found = []
    for seed in range(RIGS):
        _, kind, truth = drawn(seed)
        hidden = (kind,) if kind else ()
        hidden = (NOT_JUDGEABLE,) if kind == "hardly_moves" else hidden
        name = f"hz/{seed}_{kind or 'nothing'}"
        found.append(Case(name, hidden, truth, partial(written, seed)))
    return {case.name: case for case in found}
