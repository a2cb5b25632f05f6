"""Disturbances that no effect of the catalogue describes: what must be called unlisted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from flexgui.core.arm.arm import Arm
from flexgui.core.drives.drive import Drive
from flexgui.core.effects.effect import Effect, EffectParameter, Values
from flexgui.core.effects.per_joint import joint_direction
from flexgui.core.effects.sizes import Sizes
from flexgui.core.forces.element import Element
from flexgui.core.forces.law import V, W, joint_law
from flexgui.core.model import Model
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.motion import Task
from flexgui.core.study.detectability import Detectability, crossing
from flexgui.core.study.study_rig import STEPS, readings
from flexgui.core.trajectory import Trajectory

Shown = list[np.ndarray]
"""Outputs (N, 4) per recording, without noise."""


STRONG = 3.0
"""How much what is hidden shows: noise rms per sample."""


@dataclass(frozen=True)
class Disturbed:
    """Outputs with a disturbance in them, and what was done."""

    outputs: Shown
    level: float
    """What it shows beyond the nominal parameters, in noise rms per sample."""
    figures: dict[str, float]


def disturbed(
    kind: str, detectability: Detectability, level: float, rng: np.random.Generator
) -> Disturbed:
    """The disturbance at the size that shows `level`."""
    make, figures = OUTSIDE[kind](detectability, rng)
    m, found = crossing(lambda m: detectability.seen(make(m)), level)
    return Disturbed(make(m), found, {**figures, "size": m})


Maker = tuple[Callable[[float], Shown], dict[str, float]]


VIBRATION_HZ = (5.0, 40.0)


def vibration(detectability: Detectability, rng: np.random.Generator) -> Maker:
    """One joint trembles at one frequency, unrelated to the references: encoder and tip see it.

    The tip moves as on a rigid arm that turns about the joint; size in rad.
    """
    joint, hz = int(rng.integers(2)), float(rng.uniform(*VIBRATION_HZ))
    phases = rng.uniform(0.0, 2.0 * np.pi, len(detectability.tasks))

    def make(m: float) -> Shown:
        found = []
        for task, plain, phase in zip(
            detectability.tasks, detectability.plain, phases, strict=True
        ):
            angle = 1e-5 * m * np.sin(2.0 * np.pi * hz * task.time + phase)
            found.append(plain + angle[:, None] * _turning(detectability.base.arm, plain, joint))
        return found

    return make, {"hz": hz, "joint": joint + 1.0}


def _turning(arm: Arm, y: np.ndarray, joint: int) -> np.ndarray:
    """(N, 4): what z1, z2, theta1, theta2 change by per radian of a joint, rigidly."""
    theta1 = y[:, 2]
    l1 = arm.segments[0].length
    pivot = np.zeros((len(y), 2))
    if joint:
        pivot = l1 * np.column_stack([np.cos(theta1), np.sin(theta1)])
    arm_of = y[:, :2] - pivot
    angles = np.zeros((len(y), 2))
    angles[:, joint] = 1.0
    return np.column_stack([-arm_of[:, 1], arm_of[:, 0], angles])


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


def dragging_cable(detectability: Detectability, rng: np.random.Generator) -> Maker:
    """A cable with hysteresis pulls at joint 1; size in N at full slip of the plausible chain."""
    travel, torque = float(detectability.sizes.travel[0]), float(detectability.sizes.torque[0])
    breaks = [share * travel * rng.uniform(0.7, 1.4) for share in BREAKS]
    forces = rng.dirichlet(np.full(len(breaks), 3.0)) * 0.1 * torque

    def make(m: float) -> Shown:
        stiffness = [m * f / z for f, z in zip(forces, breaks, strict=True)]
        model = detectability.base.with_effects([DraggingCable(stiffness, breaks)])
        steps = STEPS * DraggingCable.edges
        motions = [
            run(model, model.numbers(), e.task(model), steps) for e in detectability.experiments
        ]
        return [readings(model, motion) for motion in motions]

    return make, {"travel": travel, "torque": 0.1 * torque}


PIECES = 40
"""In which the stiffness is constant."""


def drifting_stiffness(detectability: Detectability, rng: np.random.Generator) -> Maker:
    """EI of both segments drifts in a straight line within each recording, as a beam that warms.

    Size in per cent from the first to the last sample; the sign is random.
    """
    sign = float(rng.choice([-1.0, 1.0]))

    def make(m: float) -> Shown:
        shares = 1.0 + sign * 0.01 * m * np.linspace(0.0, 1.0, PIECES)
        shares = np.maximum(shares, 0.05)
        return [
            readings(detectability.base, in_pieces(detectability.base, task, shares))
            for task in detectability.tasks
        ]

    return make, {"sign": sign}


def in_pieces(model: Model, task: Task, shares: np.ndarray) -> Trajectory:
    """The motion with EI times each of `shares` for an equal part of the time.

    Each piece starts from the last state of the one before: q and q' are continuous.
    """
    EI = model.parameters["EI"].value
    ends = np.linspace(0, len(task.time) - 1, len(shares) + 1).astype(int)
    start = task.start
    q: list[np.ndarray] = []
    v: list[np.ndarray] = []
    u: list[np.ndarray] = []
    for first, last, share in zip(ends[:-1], ends[1:], shares, strict=True):
        part = slice(first, last + 1)
        piece = replace(task, time=task.time[part], references=task.references[part], start=start)
        motion = run(model, model.numbers({"EI": EI * share}), piece, STEPS)
        # The last sample of a piece is the first of the next; only the last piece keeps its own.
        kept = slice(None) if last == ends[-1] else slice(-1)
        for whole, own in zip((q, v, u), (motion.q, motion.v, motion.torque), strict=True):
            whole.append(own[kept])
        start = np.concatenate([motion.q[-1], motion.v[-1]])
    return Trajectory(
        model.arm, model.compiled, model.numbers().p, task.time,
        np.concatenate(q), np.concatenate(v), np.concatenate(u),
    )  # fmt: skip


OUTSIDE: dict[str, Callable[[Detectability, np.random.Generator], Maker]] = {
    "vibration": vibration,
    "dragging_cable": dragging_cable,
    "drifting_stiffness": drifting_stiffness,
}
