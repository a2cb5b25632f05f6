"""Convergence of one pass with equal steps: smooth motions, edges, friction's energy, slopes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from flexgui.core.effects import catalogue
from flexgui.core.effects.sizes import typical
from flexgui.core.model import Model
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import difference
from tests.forces.test_bristles import rubbing
from tests.helpers import PAPER, looped, task_from, with_modes

BASE = looped(with_modes(1, 1))
TIME = np.arange(601) * 1e-3
"""s"""
REFERENCES = np.column_stack([0.5 * np.sin(9.0 * TIME), -0.4 * np.sin(13.0 * TIME)])
"""rad/s: each joint turns round three times and more."""

STEPS = (1, 2, 4, 8, 16, 32)
EXACTLY = 1024
"""Steps per sample."""

LIMITS = {"ul1": 6.0, "ul2": 2.0}
"""N m: half of what the motion takes."""

ORDERS = {"": 1.9, "coulomb_friction": 1.5, "drive_saturation": 1.5, "backlash": 1.9}
"""Effect -> least slope of the error over the step, from one step per sample to 32. A smooth motion
is of second order. A step with an edge loses one, but there are few of them; where a play ends a
spring begins, which is no jump."""


def model_with(effect: str) -> tuple[Model, dict[str, float]]:
    """The arm with an effect of a usual size, and the values of that."""
    if not effect:
        return BASE, {}
    found = catalogue()[effect]
    items = found.parameters(BASE.arm, BASE.drive, typical(BASE.arm))
    values = {k.parameter.name: k.parameter.value for k in items}
    values |= {name: limit for name, limit in LIMITS.items() if name in values}
    return BASE.with_effects([found], values), values


def swinging(model: Model) -> Task:
    """From rest, bent, along the references."""
    start = np.zeros(2 * model.arm.coordinates)
    start[1] = 1.2
    return task_from(model, start, REFERENCES)


@pytest.mark.parametrize("effect", ORDERS)
def test_errors_fall_with_the_order_of_the_method(effect: str) -> None:
    model, _ = model_with(effect)
    task, numbers = swinging(model), model.numbers()
    exact = run(model, numbers, task, EXACTLY)
    errors = [difference(run(model, numbers, task, n), exact) for n in STEPS]
    slope = -np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert slope > ORDERS[effect], errors
    assert errors[-1] < errors[0] / 100.0


def test_the_motions_of_this_file_have_their_edges() -> None:
    """Without them the orders above would say nothing."""
    rubbed, limited, loose = (model_with(e)[0] for e in list(ORDERS)[1:])
    turns = run(rubbed, rubbed.numbers(), swinging(rubbed), 8).v[:, :2]
    assert (np.diff(np.sign(turns[1:]), axis=0) != 0).sum(axis=0).min() >= 2
    torque = np.abs(run(limited, limited.numbers(), swinging(limited), 8).torque).max(axis=0)
    assert torque == pytest.approx(list(LIMITS.values()), rel=1e-9)
    q = run(loose, loose.numbers(), swinging(loose), 8).q
    assert np.all(np.ptp(q[:, 4:], axis=0) > 1e-3)  # a play of 2 mrad is crossed


def energy(model: Model, task: Task, steps: int) -> np.ndarray:
    """(N,) J of motion and bending."""
    motion = run(model, model.numbers(), task, steps)
    K, _ = motion.compiled.linear_matrices(motion.q[0], motion.p)
    of_motion = [
        v @ motion.compiled.mass_matrix(q, motion.p) @ v
        for q, v in zip(motion.q, motion.v, strict=True)
    ]
    return 0.5 * (np.array(of_motion) + np.einsum("ni,ij,nj->n", motion.q, K, motion.q))


@pytest.mark.parametrize("way", [1e-3, 1e-6])
@pytest.mark.parametrize("steps", [1, 4, 16])
def test_friction_makes_no_energy_whatever_the_step(steps: int, way: float) -> None:
    """Of an arm that coasts, bent, with joints that rub."""
    model = rubbing(looped(PAPER, gain=0.0), way)
    start = np.array([0.3, 1.2, 0.02, -0.02, 2.0, -3.0, 0.0, 0.0])
    found = energy(model, task_from(model, start, np.zeros((1001, 2))), steps)
    assert np.diff(found).max() <= 1e-12 * found[0]  # rounding of a sum of squares
    assert found[-1] < 0.2 * found[0]


NEAR, FAR = 1e-4, 4e-4
"""Relative steps of central differences: their errors are a sixteenth of one another."""

SLOPES = (("", "EI1", 1e-6), ("coulomb_friction", "EI1", 1e-6), ("coulomb_friction", "fc1", 1e-6),
          ("backlash", "EI1", 1e-4))  # fmt: skip
"""Effect, parameter, and relative error of a difference. A play ends in one step or in the next, as
a parameter decides: there, and at the limits of a drive, slopes have small jumps."""


@pytest.mark.parametrize(("effect", "name", "most"), SLOPES)
@pytest.mark.parametrize("steps", [1, 4])
def test_with_equal_steps_differences_are_slopes_of_the_scheme(
    steps: int, effect: str, name: str, most: float
) -> None:
    """The error of the steps is a smooth function of the parameters."""
    model, values = model_with(effect)
    task, at = swinging(model), {"EI1": 520.0, **values}

    def tip(changed: Mapping[str, float]) -> np.ndarray:
        return np.concatenate(run(model, model.numbers({**at, **changed}), task, steps).tip())

    def slope(share: float) -> np.ndarray:
        up, down = (tip({name: (1.0 + sign * share) * at[name]}) for sign in (1.0, -1.0))
        return np.asarray((up - down) / (2.0 * share))

    near, far = slope(NEAR), slope(FAR)
    exact = (16.0 * near - far) / 15.0
    assert np.linalg.norm(near - exact) < most * np.linalg.norm(exact)
