"""Disturbances of a machine that no effect of the catalogue describes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from flexgui.core.arm.arm import Arm
from flexgui.core.challenge.detectability import crossing
from flexgui.core.drives.drive import Drive
from flexgui.core.effects.effect import Effect, EffectParameter, Values
from flexgui.core.effects.per_joint import joint_direction
from flexgui.core.effects.sizes import Sizes
from flexgui.core.forces.element import Element
from flexgui.core.forces.law import V, W, joint_law
from flexgui.core.recording.recording import Recording
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.motion import Task
from flexgui.core.trajectory import Trajectory
from tests.programs.studies.plain_matrix_hidden import STRONG, Sight
from tests.programs.studies.plain_matrix_rigs import STEPS_HZ, Rig

Maker = Callable[[float, Sequence[int]], list[Recording]]
"""Recordings without noise at a size, by their numbers."""

LIMITS_HZ = (5.0, 40.0)
PIECES = 20
"""In which a drifting stiffness is constant."""


def _vibration(rig: Rig, rng: np.random.Generator) -> Maker:
    """One joint trembles at a frequency of its own: its encoder sees it, and the tip turns with
    it as on a rigid arm."""
    joint, hz = int(rng.integers(rig.joints)), float(rng.uniform(*LIMITS_HZ))
    phases = rng.uniform(0.0, 2.0 * np.pi, len(rig.postures))

    def make(m: float, which: Sequence[int]) -> list[Recording]:
        found = []
        for i in which:
            motion = rig.roughly(rig.healthy, i)
            r = rig.recording(rig.healthy, i, motion)
            angle = 1e-5 * m * np.sin(2.0 * np.pi * hz * r.time + phases[i])
            channels = dict(r.channels)
            channels[f"theta{joint + 1}"] = channels[f"theta{joint + 1}"] + angle
            if r.has("z1", "z2"):
                pivot = _pivot(rig, motion.q, joint)
                z1, z2 = channels["z1"], channels["z2"]
                channels["z1"] = z1 - (z2 - pivot[:, 1]) * angle
                channels["z2"] = z2 + (z1 - pivot[:, 0]) * angle
            found.append(replace(r, channels=channels))
        return found

    return make


def _pivot(rig: Rig, q: np.ndarray, joint: int) -> np.ndarray:
    """(N, 2): where a joint is, as on a rigid arm."""
    place, angle = np.zeros((len(q), 2)), np.zeros(len(q))
    for k in range(joint):
        angle = angle + q[:, k]
        length = rig.segments[k]["length"]
        place = place + length * np.column_stack([np.cos(angle), np.sin(angle)])
    return place


_K, _Z = sp.Symbol("k_b", positive=True), sp.Symbol("z_b", positive=True)
_POWER = 2
CABLE = joint_law(
    -_K * W,
    (_K, _Z),
    rate=V - sp.Rational(1, 2) * (V * sp.Abs(W) + sp.Abs(V) * W) * sp.Abs(W) / _Z**_POWER,
)
"""One Bouc-Wen slider of stiffness k that breaks away at z; with power 2 and equal shares it is
near Jenkins's sharp one. R. Bouc 1967, Y.-K. Wen 1976."""

BREAKS = (0.4, 1.6, 6.4)
"""Of the joint's travel: beyond where presliding friction is looked for, so that the chain
remembers the whole motion."""


class DraggingCable(Effect):
    """A cable loom at joint 1: a chain of sliders in parallel, between friction and a spring.

    Not in the catalogue's folder, so nothing offers it.
    """

    kind = "dragging_cable"
    location = "joint"
    title = "Dragging cable"
    edges = 2

    def __init__(self, stiffness: Sequence[float], breaks: Sequence[float]) -> None:
        self.stiffness, self.breaks = tuple(stiffness), tuple(breaks)

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return ()

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        along = (joint_direction(arm, 0),)
        pairs = zip(self.stiffness, self.breaks, strict=True)
        return tuple(Element(CABLE, along, pair) for pair in pairs)


def _dragging_cable(rig: Rig, rng: np.random.Generator) -> Maker:
    """A cable with hysteresis pulls at joint 1: sliders in parallel that remember the motion."""
    motions = [rig.roughly(rig.healthy, i) for i in range(len(rig.postures))]
    travel = float(np.max([np.ptp(m.q[:, 0]) for m in motions]))
    torque = float(np.sqrt(np.mean([np.mean(m.torque[:, 0] ** 2) for m in motions])))
    breaks = [share * travel * rng.uniform(0.7, 1.4) for share in BREAKS]
    forces = rng.dirichlet(np.full(len(breaks), 3.0)) * 0.1 * torque

    def make(m: float, which: Sequence[int]) -> list[Recording]:
        stiffness = [m * f / z for f, z in zip(forces, breaks, strict=True)]
        machine = rig.healthy.with_effects([DraggingCable(stiffness, breaks)])
        return [rig.recording(machine, i, rig.roughly(machine, i)) for i in which]

    return make


def _drifting_stiffness(rig: Rig, rng: np.random.Generator) -> Maker:
    """All stiffnesses drift in a straight line within each recording, as beams that warm."""
    sign = float(rng.choice([-1.0, 1.0]))

    def make(m: float, which: Sequence[int]) -> list[Recording]:
        shares = np.maximum(1.0 + sign * 0.01 * m * np.linspace(0.0, 1.0, PIECES), 0.05)
        healthy = rig.healthy
        return [
            rig.recording(healthy, i, in_pieces(rig, rig.task(healthy, i), shares)) for i in which
        ]

    return make


def in_pieces(rig: Rig, task: Task, shares: np.ndarray) -> Trajectory:
    """The motion with the stiffnesses times each share for an equal part of the time; each piece
    starts from the last state of the one before."""
    model = rig.healthy
    ends = np.linspace(0, len(task.time) - 1, len(shares) + 1).astype(int)
    steps = int(np.ceil(STEPS_HZ / rig.rate))
    start, parts = task.start, list[tuple[np.ndarray, ...]]()
    for first, last, share in zip(ends[:-1], ends[1:], shares, strict=True):
        part = slice(first, last + 1)
        piece = replace(task, time=task.time[part], references=task.references[part], start=start)
        soft = {f"EI{k + 1}": s["EI"] * share for k, s in enumerate(rig.segments)}
        motion = run(model, model.numbers(soft), piece, steps)
        kept = slice(None) if last == ends[-1] else slice(-1)
        parts.append((motion.q[kept], motion.v[kept], motion.torque[kept]))
        start = np.concatenate([motion.q[-1], motion.v[-1]])
    q, v, u = (np.concatenate(one) for one in zip(*parts, strict=True))
    return Trajectory(model.arm, model.compiled, model.numbers().p, task.time, q, v, u)


OUTSIDE = {
    "vibration": _vibration,
    "dragging_cable": _dragging_cable,
    "drifting_stiffness": _drifting_stiffness,
}


def disturbed(sight: Sight, kind: str, rng: np.random.Generator) -> tuple[list[Recording], float]:
    """All recordings without noise, with a strong disturbance, and what it shows in floors."""
    make = OUTSIDE[kind](sight.bench, rng)
    few = range(len(sight.plain.experiments))
    aim = float(np.exp(rng.uniform(*np.log(STRONG))))
    m, found = crossing(lambda m: sight.seen(make(m, few)), aim)
    return make(m, range(len(sight.bench.postures))), found
