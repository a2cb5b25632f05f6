"""Inertia and forces of the compiled code against closed forms and sums over points."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from flexgui.core.arm.arm import Arm, Structure
from flexgui.core.arm.energies import damping_matrix, lumped_inertia, stiffness_matrix
from flexgui.core.arm.joints import joint
from flexgui.core.arm.joints.joint import Joint
from flexgui.core.arm.kinematics import Kinematics, components
from flexgui.core.arm.segment import Segment
from flexgui.core.arm.slots import INERTIA, arm_vector, weighing
from flexgui.core.errors import InputError
from flexgui.core.plugins import classes_of
from tests.helpers import ARMS, EVERY_ARM, PAPER, compiled, jacobian, loaded, random_state, straight

ROUNDING = 1e-12
"""Relative to the largest entry: some tens of roundings of double precision."""


def closed_form(l1: float, l2: float, m1: float, m2: float, theta2: float) -> np.ndarray:
    """M at v = 0 of two segments with one mode each, as printed in design section 2."""
    c = np.cos(theta2)
    M = np.zeros((4, 4))
    M[0, 0] = l1**2 * m1 / 3 + l1**2 * m2 + l1 * l2 * m2 * c + l2**2 * m2 / 3
    M[0, 1] = l2 * m2 * (3 * l1 * c + 2 * l2) / 6
    M[1, 1] = l2**2 * m2 / 3
    M[0, 2] = l1 * (3 * l1**2 * m1 + 2 * m2 * (6 * l1**2 + 9 * l1 * l2 * c + 4 * l2**2)) / 12
    M[1, 2] = l1 * l2 * m2 * (3 * l1 * c + 4 * l2) / 6
    M[2, 2] = l1**2 * (l1**2 * m1 / 5 + m2 * (3 * l1**2 + 6 * l1 * l2 * c + 4 * l2**2) / 3)
    M[0, 3] = l2**2 * m2 * (4 * l1 * c + 3 * l2) / 12
    M[1, 3] = l2**3 * m2 / 4
    M[2, 3] = l1 * l2**2 * m2 * (2 * l1 * c + 3 * l2) / 6
    M[3, 3] = l2**4 * m2 / 5
    return np.triu(M) + np.triu(M, 1).T


def test_inertia_of_the_straight_arm_is_the_closed_form() -> None:
    rng = np.random.default_rng(20)
    for _ in range(50):
        sizes, theta2 = rng.uniform(0.1, 2.0, (2, 2)) * [[1.0], [10.0]], rng.uniform(-np.pi, np.pi)
        segments = (Segment(length=x, mass=m, EI=1.0, modes=1) for x, m in sizes.T)
        arm = Arm(segments=tuple(segments))
        q, p = straight(np.array([0.7, theta2]), arm), arm_vector(arm)
        expected = closed_form(*sizes.ravel(), theta2)
        bound = ROUNDING * np.abs(expected).max()
        assert np.abs(compiled(arm).mass_matrix(q, p) - expected).max() < bound


@pytest.mark.parametrize("name", EVERY_ARM)
def test_inertia_is_symmetric_and_positive_when_bent(name: str) -> None:
    arm = loaded(ARMS[name])
    for seed in range(5):
        M = compiled(arm).mass_matrix(random_state(arm, seed)[0], arm_vector(arm))
        scale = np.sqrt(np.diag(M))
        assert np.array_equal(M, M.T)
        assert np.linalg.eigvalsh(M / np.outer(scale, scale)).min() > 0.0


DIFFERENCES = 1e-9
"""Central differences of fourth order with a step of 1e-3."""


@pytest.mark.parametrize("name", EVERY_ARM)
def test_tip_mass_adds_its_own_jacobian_to_the_bent_inertia(name: str) -> None:
    """M grows by mt J'J, with J by differences of the tip's place."""
    arm = ARMS[name]
    last = arm.segments[-1].model_copy(update={"tip_mass": 0.8})
    heavier = arm.model_copy(update={"segments": (*arm.segments[:-1], last)})
    q = random_state(arm, seed=4)[0]
    code = compiled(arm)
    J = jacobian(lambda x: code.tip_place(x, arm_vector(arm))[0], q)
    M = code.mass_matrix(q, arm_vector(arm))
    grown = code.mass_matrix(q, arm_vector(heavier)) - M
    assert np.abs(grown - 0.8 * J.T @ J).max() < DIFFERENCES * np.abs(M).max()


@pytest.mark.parametrize("elastic", [False, True])
def test_a_rotor_without_a_gear_turns_with_the_segment_that_carries_it(elastic: bool) -> None:
    """T grows by Jr (theta1' + theta2' + 2 l1 v1')^2 / 2, the rate of theta12 in the paper; a gear
    that twists behind the motor turns the segment and not the rotor."""
    first, second = PAPER.segments
    if elastic:
        second = second.model_copy(update={"joint_compliance": 1e-4, "hub_inertia": 0.1})
    arm = PAPER.model_copy(update={"segments": (first, second)})
    carried = second.model_copy(update={"rotor_inertia": 0.3})
    heavier = arm.model_copy(update={"segments": (first, carried)})
    q = random_state(arm, seed=6)[0]
    mass = compiled(arm).mass_matrix
    rate = np.array([1.0, 1.0, 2.0 * first.length, 0.0, *[0.0] * elastic])
    grown = mass(q, arm_vector(heavier)) - mass(q, arm_vector(arm))
    np.testing.assert_allclose(grown, 0.3 * np.outer(rate, rate), atol=ROUNDING)


GAUSS_ORDER = 8
"""Points that integrate degree 15 exactly; with three modes the integrand has 14."""


@pytest.mark.parametrize("name", EVERY_ARM)
def test_bent_inertia_and_forces_are_sums_over_points_of_the_arm(name: str) -> None:
    """Each point's own Jacobian and acceleration at constant rates, straight from its place."""
    arm = loaded(ARMS[name], gravity=(0.4, -9.7))
    p, (q, v) = arm_vector(arm), random_state(arm, 3)
    kinematics = Kinematics(Structure.of(arm))
    s = kinematics.symbols
    here = dict(zip([*s.q, *s.dq, *s.p], map(sp.Float, [*q, *v, *p]), strict=True))
    here |= {s.slot(k, INERTIA): sp.Float(0) for k in range(arm.joints)}  # summed over points
    constant, stiff, damping = (
        np.array(f(kinematics).xreplace(here), dtype=float)
        for f in (lumped_inertia, stiffness_matrix, damping_matrix)
    )
    M, F = constant, -stiff @ q - damping @ v
    at, weights = np.polynomial.legendre.leggauss(GAUSS_ORDER)
    for k, segment in enumerate(arm.segments):
        place = components(kinematics.point(k, s.x))
        J = place.jacobian(s.q)
        bias = (J * sp.Matrix(s.dq)).jacobian(s.q) * sp.Matrix(s.dq) - sp.Matrix(s.gravity)
        points = sp.lambdify(s.x, [J.xreplace(here), bias.xreplace(here)])
        places = [*(segment.length * (at + 1.0) / 2.0), segment.length]
        masses = [*(segment.mass * weights / 2.0), segment.tip_mass]
        for x, mass in zip(places, masses, strict=True):
            slopes, acceleration = points(x)
            M = M + mass * slopes.T @ slopes
            F = F - mass * (slopes.T @ acceleration)[:, 0]
    found_M, found_F = compiled(arm).mass_and_force(q, v, p)
    np.testing.assert_allclose(found_M, M, atol=ROUNDING * np.abs(M).max())
    np.testing.assert_allclose(found_F, F, atol=ROUNDING * np.abs(F).max())


@pytest.mark.parametrize("name", EVERY_ARM)
def test_only_what_weighs_changes_the_inertia(name: str) -> None:
    arm, mass = ARMS[name], compiled(ARMS[name]).mass_matrix
    p, (q, _) = arm_vector(arm), random_state(arm, 5)
    more = [p + (np.arange(len(p)) == k) for k in range(len(p))]
    weighs = {k for k, other in enumerate(more) if not np.array_equal(mass(q, other), mass(q, p))}
    assert weighs <= set(weighing(np.arange(len(p)), arm.joints))


KINDS = sorted(classes_of("flexgui.core.arm.joints", Joint))


@pytest.mark.parametrize("kind", KINDS)
def test_placement_is_linear_in_the_coordinate_and_none_at_zero(kind: str) -> None:
    """The inertia's affine statement rests on this."""
    q, axis = sp.symbols("q axis", real=True)
    put = joint(kind).place(q, axis)
    for part in (put.turn, put.slide):
        assert part.subs(q, 0) == 0
        assert sp.diff(part, q, 2) == 0
    assert not put.direction.has(q)
    assert (put.turn, put.slide) != (0, 0)


def test_an_unknown_joint_is_named_with_the_nearest_known_one() -> None:
    with pytest.raises(InputError, match="did you mean 'revolute'"):
        joint("revolut")
