"""Rigid links with a centre of mass and an inertia of their own, against a textbook's arm."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.catalogue import ArmCatalogue
from flexgui.core.arm.segment import Segment
from flexgui.core.arm.slots import arm_vector
from flexgui.core.effects.joint_load import joint_load
from flexgui.core.simulate.descriptor import descriptor
from flexgui.core.simulate.equations import equations
from tests.helpers import ARMS, compiled, loaded, looped, random_state, relative_to_largest

ROUNDING = 1e-12
"""Relative to the largest entry: some tens of roundings of double precision."""

G = 9.81


class Link(NamedTuple):
    """As a data sheet states it; `turned` is the direction of the centre seen from the joint."""

    length: float
    mass: float
    centre: float
    turned: float
    inertia: float

    @property
    def segment(self) -> Segment:
        return Segment(
            length=self.length, mass=self.mass, modes=0, inertia=self.inertia,
            centre_of_mass=self.centre * np.cos(self.turned),
            centre_of_mass_across=self.centre * np.sin(self.turned),
        )  # fmt: skip


def elbow(first: Link, second: Link) -> Arm:
    return Arm(segments=(first.segment, second.segment), gravity=(0.0, -G))


def random_links(seed: int) -> tuple[Link, Link, np.ndarray, np.ndarray]:
    """Two links with centres anywhere around their joints; joint angles and rates."""
    rng = np.random.default_rng(seed)
    links = [
        Link(*map(float, [*rng.uniform(0.2, 2.0, 3), rng.uniform(-3.0, 3.0), rng.uniform(0.1, 1)]))
        for _ in range(2)
    ]
    q, dq = rng.uniform(-3.0, 3.0, (2, 2))
    return links[0], links[1], q, dq


def textbook(
    a: Link, b: Link, q: np.ndarray, dq: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """D(q), C(q, q') q' + g(q) and dg/dq of the planar elbow manipulator (Spong, Hutchinson and
    Vidyasagar, Robot Modeling and Control, 6.4), its centres turned out of the links' lines."""
    l1, lc1, lc2, second = a.length, a.centre, b.centre, q[1] + b.turned
    coupled = l1 * lc2 * np.cos(second)
    d22 = b.mass * lc2**2 + b.inertia
    d12 = b.mass * (lc2**2 + coupled) + b.inertia
    d11 = a.mass * lc1**2 + b.mass * (l1**2 + lc2**2 + 2.0 * coupled) + a.inertia + b.inertia
    h = -b.mass * l1 * lc2 * np.sin(second)
    coriolis = np.array([h * dq[1] * (2.0 * dq[0] + dq[1]), -h * dq[0] ** 2])
    angles = np.array([q[0] + a.turned, q[0], q[0] + second])
    moments = G * np.array([a.mass * lc1, b.mass * l1, b.mass * lc2])
    level, steep = moments * np.cos(angles), -moments * np.sin(angles)
    gravity = np.array([level.sum(), level[2]])
    slope = np.array([[steep.sum(), steep[2]], [steep[2], steep[2]]])
    return np.array([[d11, d12], [d12, d22]]), coriolis + gravity, slope


@pytest.mark.parametrize("seed", range(10))
def test_two_links_are_the_textbooks_planar_elbow(seed: int) -> None:
    first, second, q, dq = random_links(seed)
    arm = elbow(first, second)
    D, needed, slope = textbook(first, second, q, dq)
    M, F = compiled(arm).mass_and_force(q, dq, arm_vector(arm))
    K, _ = compiled(arm).linear_matrices(q, arm_vector(arm))
    assert relative_to_largest(M, D) < ROUNDING
    assert relative_to_largest(F, -needed) < ROUNDING
    assert relative_to_largest(K, slope) < ROUNDING


@pytest.mark.parametrize("seed", range(3))
def test_the_affine_model_holds_at_every_posture(seed: int) -> None:
    first, second, q, dq = random_links(seed)
    model = looped(elbow(first, second))
    found = descriptor(model, model.numbers())
    values = {"1": 1.0, "cos(theta2)": np.cos(q[1]), "sin(theta2)": np.sin(q[1])}
    E = sum(values[name] * term for name, term in zip(found.basis, found.E_terms, strict=True))
    D, _, _ = textbook(first, second, q, dq)
    assert set(found.basis) == set(values)
    assert relative_to_largest(np.array(E)[2:4, 2:4], D) < ROUNDING


@pytest.mark.parametrize("name", ["rigid pair", "slide", "ground", "0-2-1"])
def test_a_uniform_beam_may_be_stated_as_such(name: str) -> None:
    bare = loaded(ARMS[name], (0.4, -G))
    stated = bare.model_copy(
        update={
            "segments": tuple(
                s if s.modes else s.model_copy(
                    update={"centre_of_mass": s.length / 2.0, "inertia": s.mass * s.length**2 / 12}
                )
                for s in bare.segments
            )
        }
    )  # fmt: skip
    q, v = random_state(bare, 2)
    for one, other in zip(
        compiled(bare).mass_and_force(q, v, arm_vector(bare)),
        compiled(stated).mass_and_force(q, v, arm_vector(stated)),
        strict=True,
    ):
        assert relative_to_largest(one, other) < ROUNDING


def test_the_displayed_equations_have_what_is_stated_and_no_more() -> None:
    first, second, _, _ = random_links(1)
    uniform = Segment(length=0.4, mass=2.0, modes=0)
    arm = Arm(segments=(first.segment, second.segment.model_copy(update={"inertia": None})))
    shown = {e.title: e.latex for e in equations(looped(arm))}
    assert r"J_{c1} \omega_{1}^2" in shown["Kinetic energy"]
    assert r"\dot{p}_{2}(x_{c2}, y_{c2})" in shown["Kinetic energy"]
    assert "J_{c1}" in shown["M0, constant part"] and "J_{c2}" not in shown["M0, constant part"]
    plain = Arm(segments=(uniform, uniform))
    assert not any("c1" in e.latex for e in equations(looped(plain)))


def test_what_is_not_stated_follows_length_and_mass_while_they_are_estimated() -> None:
    plain = Segment(length=0.5, mass=4.0, modes=0)
    known = Segment(length=0.4, mass=2.0, modes=0, centre_of_mass=0.1, inertia=0.02)
    found = ArmCatalogue(Arm(segments=(plain, known))).vectors(
        ["xc2", "l1", "m1", "l2", "m2"], np.array([[0.15, 0.8, 3.0, 0.6, 1.0]])
    )
    plain = Segment(length=0.8, mass=3.0, modes=0)
    known = Segment(length=0.6, mass=1.0, modes=0, centre_of_mass=0.15, inertia=0.02)
    assert found[0] == pytest.approx(arm_vector(Arm(segments=(plain, known))))


def test_what_is_estimated_follows_nothing() -> None:
    arm = Arm(segments=(Segment(length=0.5, mass=4.0, modes=0),))
    names = ["xc1", "yc1", "Jc1", "l1", "m1"]
    found = ArmCatalogue(arm).vectors(names, np.array([[0.3, 0.02, 0.05, 0.6, 3.0]]))
    link = Segment(
        length=0.6, mass=3.0, modes=0, centre_of_mass=0.3, centre_of_mass_across=0.02, inertia=0.05
    )
    assert found[0] == pytest.approx(arm_vector(Arm(segments=(link,))))


def test_only_rigid_links_have_a_centre_and_an_inertia_to_estimate() -> None:
    names = set(ArmCatalogue(ARMS["0-2-1"]).parameters)
    assert names & {f"{what}{k}" for what in ("xc", "yc", "Jc") for k in (1, 2, 3)} == {
        "xc1", "yc1", "Jc1"
    }  # fmt: skip


def test_a_joint_moves_what_its_mass_matrix_says() -> None:
    first, second, _, _ = random_links(4)
    arm = elbow(first, second)
    D, _, _ = textbook(first, second, np.zeros(2), np.zeros(2))
    assert [joint_load(arm, k) for k in (0, 1)] == pytest.approx(np.diag(D))
