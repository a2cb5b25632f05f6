"""What an undriven arm keeps, and what damping and loops take away."""

from __future__ import annotations

import numpy as np

from flexgui.core.model import Model
from flexgui.core.simulate.batch import run
from flexgui.core.trajectory import Trajectory
from tests.helpers import PAPER, loaded, looped, simulate_fixed, task_from

ENERGY_DRIFT = 1e-6
MOMENTUM_DRIFT = 1e-9
"""Relative to the start; the bounds that were asked for over ten seconds."""

ROUNDING = 1e-12
"""Relative growth between two samples that rounding may fake."""

EVERY = 20
"""Samples between two looks at the energy."""


def coast(
    model: Model, q: list[float], v: list[float], seconds: float, substeps: int
) -> Trajectory:
    """The motion from q and v with all references zero."""
    samples = round(seconds * 1000) + 1
    references = np.zeros((samples, model.arm.joints))
    task = task_from(model, np.array([*q, *v]), references)
    return simulate_fixed(model, model.numbers(), task, substeps)


def energy_and_momentum(motion: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Total energy, bending energy (J) and momentum of theta1 (N m s) at every EVERY-th sample."""
    K, _ = motion.compiled.linear_matrices(motion.q[0], motion.p)
    rows = []
    for q, v in zip(motion.q[::EVERY], motion.v[::EVERY], strict=True):
        momentum = motion.compiled.mass_matrix(q, motion.p) @ v
        bending = 0.5 * q @ K @ q
        rows.append((0.5 * v @ momentum + bending, bending, momentum[0]))
    total, bending, momentum = np.array(rows).T
    return total, bending, momentum


def drift(x: np.ndarray) -> float:
    return float(np.abs(x / x[0] - 1.0).max())


def test_undriven_arm_keeps_energy_and_momentum_for_ten_seconds() -> None:
    model = looped(PAPER, gain=0.0)
    motion = coast(model, [0.3, 1.2, 5e-5, -5e-5], [1.0, -0.5, 0.0, 0.0], 10.0, substeps=32)
    total, _, momentum = energy_and_momentum(motion)
    assert np.ptp(motion.q[:, 1]) > 2.0, "theta2 must move far for this to mean something"
    assert drift(total) < ENERGY_DRIFT
    assert drift(momentum) < MOMENTUM_DRIFT


def test_energy_is_kept_while_it_swings_between_bending_and_motion() -> None:
    """Much of the energy bends the links; 300 rad/s need short steps, so half a second."""
    model = looped(PAPER, gain=0.0)
    motion = coast(model, [0.3, 1.2, 0.01, -0.01], [0.1, 0.1, 0.0, 0.0], 0.5, substeps=128)
    total, bending, _ = energy_and_momentum(motion)
    assert bending.max() > 0.4 * total[0]
    assert drift(total) < ENERGY_DRIFT


def test_damping_and_loops_only_take_energy() -> None:
    arm = loaded(PAPER)
    start = ([0.3, 1.2, 0.02, -0.02], [2.0, -3.0, 0.0, 0.0])
    for model in (looped(arm, gain=0.0), looped(PAPER), looped(arm)):
        total, _, _ = energy_and_momentum(coast(model, *start, seconds=1.0, substeps=16))
        assert np.all(np.diff(total) < ROUNDING * total[0])
        assert total[-1] < 0.99 * total[0]


def test_a_coarse_pass_damps_rather_than_excites() -> None:
    """L-stable: where steps are too long for the vibration it dies out, it never grows."""
    model = looped(PAPER, gain=0.0)
    start = np.array([0.3, 1.2, 0.02, -0.02, 0.0, 0.0, 0.0, 0.0])
    motion = run(model, model.numbers(), task_from(model, start, np.zeros((2001, 2)), 0.005), 1)
    total, _, _ = energy_and_momentum(motion)
    assert np.all(np.isfinite(total))
    assert total.max() <= total[0] * (1.0 + 1e-3)  # the method's own error in its first steps
