"""Models with friction, springs and limits, their motions, and their rates by another route."""

from __future__ import annotations

from functools import cache

import numpy as np

from flexgui.core.drives import build_drive
from flexgui.core.effects import catalogue
from flexgui.core.effects.effect import Effect
from flexgui.core.effects.own import own_effect
from flexgui.core.effects.own_formula import own_parameter
from flexgui.core.forces.compiled import compile_law
from flexgui.core.model import Model, Numbers
from flexgui.core.results import Outcome
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import Simulated, simulate_within
from flexgui.core.trajectory import Trajectory
from tests.export.helpers import MODELS, outcome_of
from tests.helpers import PAPER, looped, rms

LIMITED = build_drive(
    "state_feedback",
    {
        "gains": [[400.0, 8.0, 30.0, 0.5], [200.0, 5.0, 15.0, 0.2]],
        "torque_constants": [1.5, 0.8],
        "rate_filter": 1e5,
        "current_limits": [25.0, 12.0],
    },
)
"""Poles of 1e5 1/s, and a limit that the motion below meets."""

FORMULA = own_effect(
    PAPER, "joint2",
    "-a*spline(theta2, -0.5, 1.5, b, 1, b)*sign(dtheta2)*dtheta2**2 + a*sin(3*t)*abs(u2)/5"
    " - a*min(theta1, 0.1)",
    (own_parameter("a", 0.3), own_parameter("b", 0.5)), "own_1",
)  # fmt: skip
"""A table, the time, a torque, a direction and a kink."""


def _with(*effects: str | Effect) -> Model:
    known = catalogue()
    return looped(PAPER).with_effects([known[e] if isinstance(e, str) else e for e in effects])


WHOLE: dict[str, Model] = {
    "dry friction": _with("coulomb_friction"),
    "elastic joints": _with("joint_elasticity"),
    "slide": MODELS["loop slide"],
    "limited drive": Model(PAPER, LIMITED),
    "formula": _with(FORMULA),
    "recorded torque": MODELS["torque"],
}

SAMPLES, STEP = 200, 2e-3


@cache
def whole_outcome(name: str) -> Outcome:
    return outcome_of(WHOLE[name])


@cache
def motion(name: str) -> tuple[Task, Simulated]:
    """A motion with references that swing, ours, to a millionth of what the tests allow."""
    model = WHOLE[name]
    numbers, n, t = model.numbers(), model.arm.coordinates, STEP * np.arange(SAMPLES)
    swing = [0.6 * np.sin((8.0 + 5.0 * k) * t + k) for k in range(numbers.law.references)]
    inputs = np.column_stack([t] * len(numbers.inputs)) if numbers.inputs else None
    start = np.zeros(2 * n + numbers.law.states)
    start[1] = 0.7
    task = Task(t, np.column_stack(swing), start, start[None, :n], inputs=inputs)
    return task, simulate_within(model, numbers, task, 1e-11)


def ends(model: Model, task: Task, sample: int) -> np.ndarray:
    """The inputs at the end of a sample: the first ones run straight, references may be held."""
    numbers = model.numbers()
    straight = len(numbers.inputs) + numbers.law.straight
    return np.append(task.signals[sample + 1][:straight], task.signals[sample][straight:])


def assert_same_motion(
    model: Model, q: np.ndarray, y: np.ndarray, ours: Trajectory, outcome: Outcome, share: float
) -> None:
    """Coordinates, tip and torques agree to a share of each one's rms."""
    assert outcome.state_equations is not None
    names = [each.name for each in outcome.state_equations.outputs]
    at, joints = names.index("z1"), model.arm.joints
    pairs = [(q, ours.q), (y[:, at : at + 2], ours.tip()[0])]
    pairs.append((y[:, names.index("u1") :][:, :joints], ours.torque))
    for found, expected in pairs:
        for one, other in zip(found.T, expected.T, strict=True):
            assert rms(one - other) <= share * rms(other)


def random_point(outcome: Outcome, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """x and r."""
    equations, rng = outcome.state_equations, np.random.default_rng(seed)
    assert equations is not None
    return rng.uniform(-0.3, 0.3, len(equations.states)), rng.uniform(-1, 1, len(equations.inputs))


def rates_by_hand(model: Model, numbers: Numbers, x: np.ndarray, r: np.ndarray) -> np.ndarray:
    """x' from the compiled arm, the drive's matrices, and each law in plain Python."""
    law, n, signals = numbers.law, model.arm.coordinates, len(numbers.inputs)
    q, v, s, w = np.split(x, [n, 2 * n, 2 * n + law.states])
    references = r[signals:]
    u = law.R @ references - law.P @ q - law.V @ v - law.S @ s
    u = np.clip(u, -law.limit, law.limit)
    M, f = model.compiled.mass_and_force(q, v, numbers.p)
    f[: len(u)] += u
    z, J = model.compiled.tip_place(q, numbers.p)
    rates: list[float] = []
    for e in sorted(numbers.elements, key=lambda e: e.law.bristle):
        rows, values = e.rows(n), np.array(e.values)
        rows[: 2 * e.at_tip] = J[: 2 * e.at_tip]
        places = rows @ q
        places[: 2 * e.at_tip] = z[: 2 * e.at_tip]
        written = [*u[list(e.loads)], *(r[numbers.inputs.index(name)] for name in e.inputs)]
        values[len(values) - len(written) :] = written
        ports, states = len(e.law.x), len(e.law.states)
        own = w[len(rates) : len(rates) + states]
        out = compile_law(e.law)(places, rows @ v, own, values)
        f += rows.T @ out[:ports]
        rates += out[3 * ports :][:states].tolist()
    of_drive = law.Fs @ s + law.Fq @ q + law.Fv @ v + law.Fr @ references
    return np.concatenate([v, np.linalg.solve(M, f), of_drive, rates])
