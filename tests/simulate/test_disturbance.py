"""The joint torque behind an error is found again, where it was put in."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.diagnose.force_shape_refinement import spectrum, spectrum_of_error
from flexgui.core.diagnose.missing_torque import FIRST_FREQUENCY
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.disturbance import estimate_torque, torque_answer
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.posture import posture
from flexgui.core.study.study_rig import bare_model

DT, N = 1e-3, 1500
NOISE = {"theta1": 2e-5, "theta2": 2e-5, "z1": 3e-5, "z2": 3e-5}
"""rad and m: a good encoder and a good camera."""

SHAPE = 0.97
"""Least correlation of the torque that is found with that which was there: corners are round."""

SIZE = 0.05
"""Relative, of its level."""


BAND = slice(0, 12)
"""To 10 Hz: above, the noise is heard."""

MIXED = 0.3
"""Relative: the window changes over 1.5 s / 2 pi, the loop forgets within 0.06 s."""


@pytest.fixture(scope="module")
def friction():
    """Errors (N, 4) that a known torque at the joints makes, and the torque (N, 2)."""
    model = bare_model()
    at = posture(model, np.array([0.0, 1.2]))
    time = DT * np.arange(N)
    torque = np.column_stack(
        [1.2 * np.sign(np.sin(9.0 * time)), 0.4 * np.sign(np.sin(14.0 * time + 1.0))]
    )
    # The velocity loop turns a torque into a reference: u = Λ (r - θ').
    law = at.numbers.law
    references = np.linalg.solve(law.R, torque.T).T
    n = model.arm.coordinates
    start = np.concatenate([at.q, np.zeros(n + law.states)])
    motion = run(model, at.numbers, Task(time, references, start, at.q[None, :]), 4)
    still, _ = model.compiled.tip_place(at.q, at.numbers.p)
    rng = np.random.default_rng(3)
    clean = np.column_stack([motion.joint_positions - at.q[:2], motion.tip()[0] - still])
    return at, clean + rng.standard_normal(clean.shape) * list(NOISE.values()), torque


def test_a_known_torque_is_found_again(friction) -> None:
    at, error, torque = friction
    found = estimate_torque(at, list(NOISE), error, list(NOISE.values()), DT)
    assert found is not None
    for k in range(2):
        assert np.corrcoef(found.torque[:, k], torque[:, k])[0, 1] > SHAPE
        level = np.median(np.abs(found.torque[:, k]))
        assert level == pytest.approx(np.abs(torque[:, k]).max(), rel=SIZE)


def test_encoders_alone_suffice_and_a_chosen_agility_is_kept(friction) -> None:
    at, error, torque = friction
    found = estimate_torque(at, ["theta1", "theta2"], error[:, :2], [2e-5, 2e-5], DT, 10.0)
    assert found is not None and found.agility == 10.0
    assert np.corrcoef(found.torque[:, 0], torque[:, 0])[0, 1] > 0.9


def test_noise_alone_needs_no_torque(friction) -> None:
    at, error, torque = friction
    noise = np.random.default_rng(4).standard_normal(error.shape) * list(NOISE.values())
    found = estimate_torque(at, list(NOISE), noise, list(NOISE.values()), DT)
    assert found is not None
    assert np.abs(found.torque).max() < 0.1 * np.abs(torque).max()


def test_an_output_that_is_not_of_the_motion_is_no_use(friction) -> None:
    at, error, _ = friction
    assert estimate_torque(at, ["i1"], error[:, :1], [1.0], DT) is None


def test_the_answer_to_a_torque_is_that_of_the_simulated_arm(friction) -> None:
    at, error, torque = friction
    known, answer = torque_answer(at, [*NOISE, "i1"], DT, np.fft.rfftfreq(N)[FIRST_FREQUENCY:])
    assert known == [0, 1, 2, 3]
    heard = spectrum_of_error(error)[BAND]
    expected = np.einsum("fkj,fj->fk", answer, spectrum(torque))[BAND]
    for h, x in zip(heard.T, expected.T, strict=True):
        assert np.linalg.norm(h - x) < MIXED * np.linalg.norm(x)
