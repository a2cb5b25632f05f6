"""Modes of a posture against NumPy's eigenvalues and against the clamped beam of the books."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.model import Model
from flexgui.core.simulate.posture import SHOWN_SHARE, Mode, Posture, posture, vibration_modes
from tests.helpers import ARMS, chain, loaded, looped, state_matrices
from tests.simulate.test_linear_model import CASCADE, FILTERED

SAME_POLES = 1e-7
"""Relative to the largest pole; two algorithms on stiff matrices, double zeros among the poles."""

SOLVES = 1e-9
"""Relative residual of an eigenvector."""

BEAM_MODES = (1.875104, 4.694091)
"""Roots of cos(b) cosh(b) = -1: the clamped-free beam (Blevins, Formulas for natural frequency)."""

BEAM_MISS = (5e-4, 0.02)
"""Relative: three polynomials bound a frequency from above, the first the closest."""

JOINTS = np.array([0.3, 1.2, -0.4])


def at(name: str, model: Model | None = None) -> Posture:
    arm = ARMS[name]
    return posture(model or looped(arm, 20.0), JOINTS[: arm.joints])


def nearest(poles: np.ndarray, others: np.ndarray) -> float:
    """Largest distance from a pole to the nearest of the others."""
    return float(np.abs(poles[:, None] - others[None, :]).min(axis=1).max())


@pytest.mark.parametrize("name", ["one mode", "1-1", "2-2", "slide", "ground", "0-2-1"])
def test_poles_are_the_eigenvalues_of_the_state_matrix(name: str) -> None:
    here = at(name)
    expected = np.linalg.eigvals(np.linalg.inv(here.E) @ here.A)
    assert nearest(here.poles, expected) < SAME_POLES * np.abs(expected).max()
    assert nearest(expected, here.poles) < SAME_POLES * np.abs(expected).max()


@pytest.mark.parametrize("drive", [FILTERED, CASCADE], ids=["with states", "position loop"])
def test_the_drive_is_closed_as_in_the_simulator(drive) -> None:  # type: ignore[no-untyped-def]
    model = Model(loaded(ARMS["1-1"]), drive)
    here = at("1-1", model)
    A, B = state_matrices(model, model.numbers(), here.joints)
    assert np.allclose(np.linalg.solve(here.E, here.A), A, rtol=SOLVES, atol=SOLVES)
    assert np.allclose(np.linalg.solve(here.E, here.B), B, rtol=SOLVES, atol=SOLVES)


def test_a_clamped_segment_swings_as_a_cantilever() -> None:
    arm = chain(3)
    segment = arm.segments[0]
    here = posture(looped(arm, 5.0), np.array([0.7]))
    scale = np.sqrt(segment.bending_stiffness * segment.length / segment.mass)
    for mode, root, miss in zip(vibration_modes(here, clamped=True), BEAM_MODES, BEAM_MISS):  # noqa: B905
        expected = (root / segment.length) ** 2 * scale / (2.0 * np.pi)
        assert expected * (1 - 1e-9) <= mode.frequency <= expected * (1.0 + miss)
        assert mode.damping == pytest.approx(0.0, abs=SOLVES)


def test_kelvin_voigt_damping_grows_with_the_frequency() -> None:
    """zeta = tau omega / 2 of each undamped frequency omega."""
    tau = 1e-3
    arm = chain(3)
    damped = arm.model_copy(
        update={"segments": (arm.segments[0].model_copy(update={"damping_time": tau}),)}
    )
    here = posture(looped(damped, 5.0), np.array([0.0]))
    for mode in vibration_modes(here, clamped=True):
        assert mode.damping == pytest.approx(tau * abs(mode.pole) / 2.0)


@pytest.mark.parametrize("clamped", [False, True])
@pytest.mark.parametrize("name", ["2-2", "slide", "ground"])
def test_modes_are_sorted_and_hold_one_of_each_pair(name: str, clamped: bool) -> None:
    here = at(name)
    modes = vibration_modes(here, clamped)
    assert modes
    joints = [bool(np.any(mode.vector[: here.model.arm.joints])) for mode in modes]
    assert not (clamped and any(joints))
    assert all(mode.pole.imag > 0.0 for mode in modes)
    assert [m.frequency for m in modes] == sorted(m.frequency for m in modes)


def test_a_mode_solves_the_equations_of_motion() -> None:
    here = at("2-2")
    law = here.numbers.law
    joints = here.model.arm.joints
    K, D = here.K.copy(), here.D.copy()
    K[:joints] += law.P
    D[:joints] += law.V
    for mode in vibration_modes(here):
        s, x = mode.pole, mode.vector
        terms = (s * s * here.M @ x, s * D @ x, K @ x)
        size = max(np.abs(t).max() for t in terms)
        assert np.abs(sum(terms)).max() < SOLVES * size


def test_a_mode_is_scaled_for_looking_at() -> None:
    """The tip never moves further than the stated share of the arm's length."""
    here = at("2-2")
    reach = sum(s.length for s in here.model.arm.segments)
    slope = here.model.compiled.tip_place(here.q, here.numbers.p)[1]
    for mode in vibration_modes(here):
        tips = (mode.motion(here.q, 64) - here.q) @ slope.T
        assert 0.0 < np.abs(tips).max() <= SHOWN_SHARE * reach * (1.0 + SOLVES)


def test_a_mode_plays_one_closed_period() -> None:
    mode = Mode(complex(-1.0, 20.0), np.array([0.1, 0.2j]))
    q = np.array([1.0, 2.0])
    motion = mode.motion(q, 8)
    assert np.allclose(motion[0], q + mode.shape)
    assert np.allclose(motion.mean(axis=0), q)
    assert np.allclose(motion[4] - q, -(motion[0] - q))


def test_a_rigid_arm_without_a_spring_has_no_modes() -> None:
    assert vibration_modes(at("rigid pair")) == ()
    assert vibration_modes(at("rigid pair"), clamped=True) == ()
