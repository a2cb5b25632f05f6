"""Extra forces inside the integrator, against routes that do not pass through it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from flexgui.core.arm.arm import Arm
from flexgui.core.effects.effect import Effect, EffectParameter
from flexgui.core.forces.compiled import compile_law
from flexgui.core.forces.element import Element, linear_matrices
from flexgui.core.forces.law import ForceLaw, V, W, X, joint_law
from flexgui.core.model import Model
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import ARMS, PAPER, looped, task_from, torque_of

A, B = sp.symbols("a b", positive=True)
X2, V2 = sp.symbols("x2 v2", real=True)

DAMPER = joint_law(-A * V, (A,))
SPRING = joint_law(-A * X, (A,))
DRY = joint_law(-A * sp.tanh(V / B), (A, B))
MAXWELL = joint_law(-A * W, (A, B), rate=V - W / B)
"""A spring in series with a damper: w is what the spring is stretched by, B the time it takes."""
TIP = ForceLaw((X, X2), (V, V2), (-A * V + B, -A * V2), (A, B))
"""A damper at the tip and a constant pull along the first direction."""

AGAINST_SCIPY = 1e-6
"""m, rad or their rates: the tolerance of the reference is a thousandth of it."""


class Given(Effect):
    """Carries elements that a test made."""

    def __init__(self, elements: tuple[Element, ...]) -> None:
        self._elements = elements

    def parameters(self, arm, drive, sizes) -> tuple[EffectParameter, ...]:  # type: ignore[no-untyped-def]
        return ()

    def elements(self, arm, p, values) -> tuple[Element, ...]:  # type: ignore[no-untyped-def]
        return self._elements


def forced(base: Model, *elements: Element) -> Model:
    return replace(base, effects=(Given(elements),))


def at(arm: Arm, coordinate: int) -> np.ndarray:
    return np.eye(arm.coordinates)[coordinate]


def elements_of_all_kinds(arm: Arm) -> tuple[Element, ...]:
    mixed = at(arm, 0) - 0.5 * at(arm, 1)
    return (
        Element(DRY, (at(arm, 0),), (1.5, 0.05)),
        Element(MAXWELL, (mixed,), (200.0, 0.02)),
        Element(SPRING, (at(arm, 2),), (30.0,)),
        Element(TIP, (), (4.0, 2.0), at_tip=True),
        Element(MAXWELL, (at(arm, 1),), (50.0, 0.005)),
    )


def excited(model: Model, samples: int = 200):  # type: ignore[no-untyped-def]
    start = np.zeros(2 * model.arm.coordinates)
    start[: model.arm.joints] = (0.3, 1.2)[: model.arm.joints]
    time = np.arange(samples) * 1e-3
    references = np.column_stack([0.4 * np.sin(20 * time), 0.5 * np.cos(31 * time)])
    return task_from(model, start, references[:, : model.arm.joints])


def test_all_kinds_of_elements_agree_with_a_reference_solution() -> None:
    """SciPy's implicit integrator over the equations as they are written down."""
    model = forced(looped(PAPER), *elements_of_all_kinds(PAPER))
    task, n = excited(model, 25), PAPER.coordinates
    expected = reference_solution(model, task, 1e-9)
    motion = simulate_within(model, model.numbers(), task, 1e-8).trajectory
    assert np.abs(motion.q - expected[:, :n]).max() < AGAINST_SCIPY
    assert np.abs(motion.v - expected[:, n : 2 * n]).max() < 100.0 * AGAINST_SCIPY


def reference_solution(model: Model, task: Task, rtol: float) -> np.ndarray:
    """(N, 2 n + 2): q, q' and the states of two elements, by SciPy's implicit integrator."""
    numbers, found = model.numbers(), [np.concatenate([task.start, np.zeros(2)])]
    for r in task.references[:-1]:
        solved = solve_ivp(
            lambda t, y, r=r: _rate(model, numbers, y, r), (0.0, task.sample_time), found[-1],
            method="Radau", rtol=rtol, atol=0.01 * rtol,
        )  # fmt: skip
        found.append(solved.y[:, -1])
    return np.array(found)


def _rate(model: Model, numbers, y: np.ndarray, r: np.ndarray) -> np.ndarray:  # type: ignore[no-untyped-def]
    """y' for y = [q, q', w], with the forces of the elements added by hand."""
    n, joints = model.arm.coordinates, model.arm.joints
    q, v, w = y[:n], y[n : 2 * n], y[2 * n :]
    M, F = model.compiled.mass_and_force(q, v, numbers.p)
    F[:joints] += torque_of(numbers.law, q, v, np.zeros(0), r)
    z, J = model.compiled.tip_place(q, numbers.p)
    dw, used = np.zeros(len(w)), 0
    for one in numbers.elements:
        rows, m = one.rows(n), len(one.law.states)
        x = rows @ q
        if one.at_tip:
            rows, x = J, z
        k = len(x)
        out = compile_law(one.law)(x, rows @ v, w[used : used + m], np.array(one.values))
        F += rows.T @ out[:k]
        dw[used : used + m] = out[3 * k : 3 * k + m]
        used += m
    return np.concatenate([v, np.linalg.solve(M, F), dw])


@pytest.mark.parametrize("name", ["1-1", "2-2", "slide"])
def test_steps_converge_at_second_order_with_elements(name: str) -> None:
    """Dry friction apart: its steep edge needs steps that resolve it."""
    arm = ARMS[name]
    base = looped(arm, gain=40.0)
    model = forced(base, *elements_of_all_kinds(arm)[1:])
    task, numbers = excited(model), model.numbers()
    fine = run(model, numbers, task, 256)
    errors = [np.abs(run(model, numbers, task, s).q - fine.q).max() for s in (8, 16, 32)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(orders > 1.7), errors


def test_a_damper_at_a_joint_is_a_velocity_loop_with_that_gain() -> None:
    """The loop's reference is zero, so the two are one and the same."""
    free = looped(PAPER, gain=0.0)
    dampers = [Element(DAMPER, (at(PAPER, k),), (gain,)) for k, gain in enumerate((6.0, 3.0))]
    braked = forced(free, *dampers)
    looped_in = replace(free, drive=free.drive.model_copy(update={"gains": (6.0, 3.0)}))
    task = excited(free)
    still = replace(task, references=np.zeros_like(task.references))
    still.start[PAPER.coordinates : PAPER.coordinates + 2] = (0.5, -0.4)
    a, b = (run(m, m.numbers(), still, 8) for m in (braked, looped_in))
    assert np.abs(a.q - b.q).max() < 1e-12


def test_the_same_element_twice_is_one_of_twice_the_size() -> None:
    base = looped(PAPER)
    twice = forced(base, *2 * [Element(MAXWELL, (at(PAPER, 1),), (50.0, 0.01))])
    once = forced(base, Element(MAXWELL, (at(PAPER, 1),), (100.0, 0.01)))
    task = excited(base)
    a, b = (run(m, m.numbers(), task, 4) for m in (twice, once))
    assert np.abs(a.q - b.q).max() < 1e-12


def test_a_steady_pull_at_the_tip_moves_it_by_what_statics_says() -> None:
    """Joints held by springs, a slow damper, a force of 2 N: J K^-1 J' F after everything rests."""
    stiff = (400.0, 300.0)
    base = looped(PAPER, gain=30.0)
    springs = [Element(SPRING, (at(PAPER, k),), (s,)) for k, s in enumerate(stiff)]
    model = forced(base, *springs, Element(TIP, (), (60.0, 0.02), at_tip=True))
    start = np.zeros(2 * PAPER.coordinates)
    task = task_from(model, start, np.zeros((4000, 2)))
    numbers = model.numbers()
    motion = run(model, numbers, task, 4)
    K = model.compiled.linear_matrices(np.zeros(4), numbers.p)[0]
    K += np.diag([*stiff, 0.0, 0.0])
    J = model.compiled.tip_place(motion.q[-1], numbers.p)[1]
    assert motion.q[-1] == pytest.approx(np.linalg.solve(K, J.T @ [0.02, 0.0]), abs=1e-7)


def test_linear_matrices_are_the_slopes_of_the_forces() -> None:
    arm = PAPER
    b = np.array([1.0, -0.5, 0.3, 0.0])
    cross = ForceLaw((X, X2), (V, V2), (-A * (X - X2) - B * V, A * (X - X2)), (A, B))
    both = (Element(cross, (b, at(arm, 3)), (7.0, 2.0)), Element(DAMPER, (b,), (3.0,)))
    K, D = linear_matrices(both, np.array([0.2, 1.1, 0.0, 0.0]))
    apart = b - at(arm, 3)
    assert np.allclose(K, 7.0 * np.outer(apart, apart), atol=1e-7)
    assert np.allclose(D, 5.0 * np.outer(b, b), atol=1e-7)
