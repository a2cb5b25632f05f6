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

from tests.programs.mujoco.chain import Beam, Motor, Plant, mjcf

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
"""s, of the engine at most: as for the other chains. A chain of stiff short pieces needs less."""
FASTEST = 30.0
"""rad/s or m/s: nobody keeps a recording of an unstable loop."""
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
    counts: float = 1.0
    """Standard deviation of the white noise before it counts, in counts."""
    modes: int = 2
    """Stated of each segment that bends."""
    viscous: tuple[float, ...] = ()
    """N m s/rad or N s/m per joint."""
    coulomb: tuple[float, ...] = ()
    """N m or N per joint."""
    payload: float = 0.0
    """kg, a point at the tip."""
    hub_inertia: float = 0.0
    """kg m² of each motor, which is stated."""
    springs: tuple[float, ...] = ()
    """N m/rad between each motor, which then needs an inertia, and its link; none: rigid."""
    disturbance: tuple[float, ...] = ()
    """N m or N with which something nearby shakes each joint: no effect of the catalogue."""
    disturbance_hz: float = 0.0
    recordings: int = 2
    hinges: int = 10
    """Of a chain in the engine, per segment that bends."""

    @property
    def joints(self) -> int:
        return len(self.masses)

    @property
    def step(self) -> float:
        """rad or m, of an encoder."""
        return (1.0 if self.slide else 2.0 * np.pi) / 2.0**self.bits

    @property
    def engine_step(self) -> float:
        """s, a whole part of a sample: within the period of the fastest hinge of its chain."""
        length, mass = (np.array(x) / self.hinges for x in (self.lengths, self.masses))
        inertia = mass * length**2 / 12.0
        fastest = 2.0 * float(np.sqrt(np.array(self.stiffness) / length / inertia).max())
        return float(1.0 / self.rate / np.ceil(max(1.0 / STEP, fastest) / self.rate))

    def per_joint(self, values: tuple[float, ...]) -> np.ndarray:
        """(joints,) zeros where nothing is said."""
        return np.array(values or (0.0,) * self.joints)

    @property
    def couplings(self) -> np.ndarray:
        """(n, n) of the kinetic energy, 1/2 sum_jk a_jk cos(p_j - p_k) p_j' p_k', of uniform rods
        in a row with absolute directions p; of a slide its mass."""
        m, n = np.array(self.masses), self.joints
        if self.slide:
            return np.array([[m[0] + self.payload]])
        beyond = np.cumsum(m[::-1])[::-1] - m + self.payload
        found = np.zeros((n, n))
        for j in range(n):
            for k in range(j, n):
                share = m[k] / (3.0 if j == k else 2.0) + beyond[k]
                found[j, k] = found[k, j] = share * self.lengths[j] * self.lengths[k]
        return found

    def inertia(self, place: np.ndarray) -> np.ndarray:
        """(n, n) of the links over the joints' rates, at joint positions (n,)."""
        across = np.tril(np.ones((self.joints, self.joints)))
        directions = across @ place
        apart = np.cos(directions[:, None] - directions)
        return np.asarray(across.T @ (self.couplings * apart) @ across)

    @property
    def constants(self) -> tuple[np.ndarray, ...]:
        """What `_rate` takes."""
        return (
            self.couplings, np.full(self.joints, self.hub_inertia), self.per_joint(self.viscous),
            self.per_joint(self.coulomb), self.per_joint(self.disturbance),
            self.per_joint(self.springs), np.array([self.disturbance_hz]),
        )  # fmt: skip


@njit(cache=True)
def _rate(t, y, u, constants):  # type: ignore[no-untyped-def]
    """Of the state [place, rate] of the motors, and where joints are soft then of the links behind
    them, each by joint: u less friction moves a motor, and what is left of it or a spring the link.
    """
    A, hub, viscous, coulomb, disturbance, spring, hz = constants
    n, soft = len(hub), spring[0] > 0.0
    v = y[n : 2 * n]
    pushed = u - viscous * v - coulomb * np.tanh(v / SLIDING)
    pushed = pushed + disturbance * np.sin(2.0 * np.pi * hz[0] * t)
    found = np.empty(len(y))
    found[:n] = v
    link, rates = (y[2 * n : 3 * n], y[3 * n :]) if soft else (y[:n], v)
    through = spring * (y[:n] - link) if soft else pushed
    p, w = np.cumsum(link), np.cumsum(rates)
    M, force = np.empty((n, n)), np.empty(n)
    for j in range(n):
        force[j] = through[j] - (through[j + 1] if j + 1 < n else 0.0)
        for k in range(n):
            M[j, k] = A[j, k] * np.cos(p[j] - p[k])
            force[j] -= A[j, k] * np.sin(p[j] - p[k]) * w[k] ** 2
            if not soft:  # the hub's own rate, in absolute directions
                M[j, k] += _geared(hub, j, k)
    turned = np.linalg.solve(M, force)
    bent = turned.copy()
    bent[1:] -= turned[:-1]
    if soft:
        found[n : 2 * n] = (pushed - through) / hub
        found[2 * n : 3 * n], found[3 * n :] = rates, bent
    else:
        found[n:] = bent
    return found


@njit(cache=True)
def _geared(hub, j, k):  # type: ignore[no-untyped-def]
    """Of sum_k hub_k (p_k' - p_(k-1)')^2, the entry (j, k) of its matrix."""
    if j == k:
        return hub[j] + (hub[j + 1] if j + 1 < len(hub) else 0.0)
    return -hub[max(j, k)] if abs(j - k) == 1 else 0.0


@njit(cache=True)
def _advanced(t, y, u, constants, h, steps):  # type: ignore[no-untyped-def]
    """The state so many steps of length h later, by fourth-order Runge-Kutta."""
    for _ in range(steps):
        a = _rate(t, y, u, constants)
        b = _rate(t + h / 2, y + h / 2 * a, u, constants)
        c = _rate(t + h / 2, y + h / 2 * b, u, constants)
        d = _rate(t + h, y + h * c, u, constants)
        y, t = y + h / 6 * (a + 2 * b + 2 * c + d), t + h
    return y


class _Integrated:
    """A rigid rig in motion; no camera looks at it."""

    def __init__(self, rig: TorqueRig, place: np.ndarray) -> None:
        self.rig, self.samples = rig, 0
        still = np.concatenate([place, np.zeros(rig.joints)])
        self.state = np.tile(still, 2 if rig.springs else 1)
        swing = max(rig.springs, default=0.0) / (rig.hub_inertia or np.inf)
        self.steps = max(SUBSTEPS, int(np.ceil(5.0 * np.sqrt(swing) / rig.rate)))

    @property
    def place(self) -> np.ndarray:
        return self.state[: self.rig.joints]

    @property
    def tip(self) -> np.ndarray:
        return np.zeros(0)

    def advance(self, torque: np.ndarray) -> None:
        """By one sample, with the torque held."""
        dt = 1.0 / self.rig.rate
        at = self.samples * dt
        n = self.steps
        self.state = _advanced(at, self.state, torque, self.rig.constants, dt / n, n)
        self.samples += 1


class _Chain:
    """A flexible rig in the engine; its camera sees the tip."""

    def __init__(self, rig: TorqueRig, place: np.ndarray) -> None:
        self.rig = rig
        beams = tuple(
            Beam(length, mass, EI, rig.hinges)
            for length, mass, EI in zip(rig.lengths, rig.masses, rig.stiffness, strict=True)
        )
        frictions_and_springs = map(rig.per_joint, (rig.viscous, rig.coulomb, rig.springs))
        motors = tuple(
            Motor(1.0, float(c), float(v), inertia=rig.hub_inertia, spring=float(k) or None)
            for v, c, k in zip(*frictions_and_springs, strict=True)
        )
        text = mjcf(Plant(beams, motors, tip_mass=rig.payload), rig.engine_step)
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
        mujoco.mj_step(self.model, self.data, round(1.0 / self.rig.rate / self.rig.engine_step))
        assert not any(w.number for w in self.data.warning), "the engine diverged"


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
    inertia = WRONG_MASS * np.diag(rig.inertia(middle)) + rig.hub_inertia
    stiff, damping = FEEDBACK**2 * inertia, 2.0 * FEEDBACK * inertia
    rows, before = [], middle
    for i, (q, v, a) in enumerate(zip(place + middle, speed, acceleration, strict=True)):
        counts = world.place / rig.step + rig.counts * rng.normal(size=rig.joints)
        seen = rig.step * np.round(counts)
        rate = (seen - before) * rig.rate if i else np.zeros(rig.joints)
        assert np.all(np.abs(rate) < FASTEST), "the loop is unstable: record faster"
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
            text += f"EI = {rig.stiffness[k] * WRONG_STIFFNESS[k]!r}\nmodes = {rig.modes}\n"
        else:
            text += "modes = 0\n"
        if rig.hub_inertia:
            text += f"hub_inertia = {rig.hub_inertia!r}\n"
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
        posture = [0.0, 0.7 + 0.8 * i, -0.9 + 0.6 * i][: rig.joints]
        table = recorded(rig, posture, seed + i)
        np.savetxt(
            folder / f"r{i + 1}.csv", np.column_stack(list(table.values())), "%.9g", ",",
            header=",".join(table), comments="",
        )  # fmt: skip
    path = folder / "scenario.toml"
    path.write_text(scenario_text(rig), encoding="utf-8")
    return path
