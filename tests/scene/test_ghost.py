"""The measured arm is rebuilt from what a rig measures; its bending is drawn so that it is seen."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.slots import arm_vector
from flexgui.core.recording.recording import Recording
from flexgui.scene.arm_geometry import ArmGeometry
from flexgui.scene.recorded_motion import (
    FACTORS,
    LARGEST_DEFLECTION,
    filled,
    fitting_factor,
    largest_deflection,
    measured_postures,
)
from tests.helpers import ARMS, PAPER, compiled, looped, random_state

RECOVERED = 1e-4
"""Relative to the largest modal coordinate: what the regularisation leaves after its steps."""

NEARLY_STRETCHED = 0.02
"""The same at the smallest working point, where bending hardly moves the tip along the arm."""

TIP_REACHED = 1e-6
"""m, below any camera's noise."""

NOISE = 1e-4
"""m, of a camera in the test."""

WORST_BEND = 0.02
"""m, of the deflection that such noise may make along a direction that the tip does not show."""


def motion(arm: Arm, samples: int = 12) -> np.ndarray:
    """q (N, n) with a little of every mode."""
    rng = np.random.default_rng(6)
    q = np.zeros((samples, arm.coordinates))
    q[:, : arm.joints] = rng.uniform(-0.2, 0.2, (samples, arm.joints))
    if arm.joints > 1:
        q[:, 1] += 1.3
    for k, s in enumerate(arm.segments):
        scale = [0.02 / s.length ** (i + 1) / (i + 1) for i in range(s.modes)]
        q[:, arm.modal_slice(k)] = rng.uniform(-1.0, 1.0, (samples, s.modes)) * scale
    return q


def recording(arm: Arm, q: np.ndarray, **channels: np.ndarray) -> Recording:
    joints = {f"theta{k + 1}": q[:, k] for k in range(arm.joints)}
    return Recording("test", np.arange(len(q)) * 1e-3, {**joints, **channels})


def tips(arm: Arm, q: np.ndarray) -> np.ndarray:
    p = looped(arm).numbers().p
    return np.array([compiled(arm).tip_place(row, p)[0] for row in q])


def rebuilt(arm: Arm, q: np.ndarray, **channels: np.ndarray) -> np.ndarray:
    model = looped(arm)
    found = measured_postures(recording(arm, q, **channels), model, model.numbers())
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("theta2", "miss"), [(np.pi / 8.0, NEARLY_STRETCHED), (1.3, RECOVERED), (2.7, RECOVERED)]
)
def test_one_mode_per_segment_is_recovered_from_the_tip(theta2: float, miss: float) -> None:
    arm = ARMS["1-1"]
    q = motion(arm)
    q[:, 1] = theta2
    z = tips(arm, q)
    found = rebuilt(arm, q, z1=z[:, 0], z2=z[:, 1])
    assert np.abs(found - q).max() < miss * np.abs(q[:, 2:]).max()


@pytest.mark.parametrize("name", ["1-1", "slide"])
def test_one_mode_is_recovered_from_the_link_deflection(name: str) -> None:
    arm = ARMS[name] if name == "1-1" else ARMS["one mode"]
    q = motion(arm)
    chords = {
        f"deflection{k + 1}": q[:, arm.modal_slice(k).start] * s.length
        for k, s in enumerate(arm.segments)
    }
    assert np.allclose(rebuilt(arm, q, **chords), q)


def test_with_more_modes_the_tip_stands_where_it_was_seen() -> None:
    arm = ARMS["2-2"]
    q = motion(arm)
    z = tips(arm, q)
    found = rebuilt(arm, q, z1=z[:, 0], z2=z[:, 1])
    assert np.abs(tips(arm, found) - z).max() < TIP_REACHED


def test_of_all_bendings_the_one_with_the_least_energy_is_taken() -> None:
    arm = ARMS["2-2"]
    model = looped(arm)
    K = model.compiled.linear_matrices(np.zeros(arm.coordinates), model.numbers().p)[0]
    q = motion(arm)
    z = tips(arm, q)
    found = rebuilt(arm, q, z1=z[:, 0], z2=z[:, 1])
    energy, true = (np.einsum("ni,ij,nj->n", x, K, x) for x in (found, q))
    assert np.all(energy < true * 1.001)


def test_a_force_at_the_tip_bends_the_ghost_as_a_cantilever() -> None:
    """delta = (3 l x^2 - x^3) F / 6 EI: the least energy for a given chord angle."""
    arm = ARMS["three modes"]
    length = arm.segments[0].length
    q = np.zeros((2, arm.coordinates))
    found = rebuilt(arm, q, deflection1=np.full(2, 0.03))[0, 1:]
    assert found == pytest.approx(0.03 * np.array([1.5 / length, -0.5 / length**2, 0.0]), abs=1e-9)


def test_noise_does_not_become_bending_that_the_tip_cannot_show() -> None:
    """A single link's tip hardly moves along the link, so that noise must not bend it."""
    arm = ARMS["three modes"]
    q = motion(arm, samples=200)
    z = tips(arm, q) + NOISE * np.random.default_rng(1).standard_normal((200, 2))
    found = rebuilt(arm, q, z1=z[:, 0], z2=z[:, 1])
    length = arm.segments[0].length
    sizes = found[:, 1:] * length ** np.arange(2, 5)
    assert np.abs(sizes).max() < 3.0 * WORST_BEND


def test_only_encoders_show_where_the_arm_is_and_they_alone_show_no_bending() -> None:
    arm = ARMS["2-2"]
    q, model = motion(arm), looped(arm)
    assert np.all(rebuilt(arm, q)[:, 2:] == 0.0)
    bare = Recording("bare", np.arange(3.0), {"z1": np.zeros(3), "z2": np.zeros(3)})
    assert measured_postures(bare, model, model.numbers()) is None


def test_columns_are_filled_between_their_samples() -> None:
    values = np.array([[np.nan], [1.0], [np.nan], [3.0]])
    assert filled(np.arange(4.0), values)[:, 0] == pytest.approx([1.0, 1.0, 2.0, 3.0])
    assert np.all(filled(np.arange(2.0), np.full((2, 1), np.nan)) == 0.0)


STEP = 1.6
"""Between a factor and what would be exact: half a step of 1, 2, 5, 10 is at most sqrt(2.5)."""

P = arm_vector(PAPER)
REACH = ArmGeometry(PAPER, P).reach


def bent(by: float) -> np.ndarray:
    """(5, n) postures whose bending is about `by`."""
    return np.array([random_state(PAPER, seed, bend=by)[0] for seed in range(5)])


@pytest.mark.parametrize("by", [0.003, 0.006, 0.012, 0.03, 0.08])
def test_the_largest_deflection_is_drawn_at_a_share_of_the_reach(by: float) -> None:
    q = bent(by)
    drawn = fitting_factor(PAPER, P, q) * largest_deflection(PAPER, P, q) / REACH
    least, most = FACTORS[0], FACTORS[-1]
    if least < fitting_factor(PAPER, P, q) < most:
        assert LARGEST_DEFLECTION / STEP <= drawn <= LARGEST_DEFLECTION * STEP


def test_a_larger_bending_is_not_exaggerated_more() -> None:
    factors = [fitting_factor(PAPER, P, bent(by)) for by in (1e-6, 1e-3, 1e-2, 1e-1, 1.0)]
    assert factors == sorted(factors, reverse=True)
    assert set(factors) <= set(FACTORS)


def test_what_does_not_bend_or_has_no_numbers_is_drawn_as_it_is() -> None:
    straight, unknown = bent(0.01), np.full((3, PAPER.coordinates), np.nan)
    straight[:, PAPER.joints :] = 0.0
    for q in (straight, straight[:0], unknown):
        assert fitting_factor(PAPER, P, q) == 1.0


def test_a_slow_camera_is_followed_in_between() -> None:
    arm = ARMS["1-1"]
    q = np.repeat(motion(arm, samples=1), 9, axis=0)
    z = tips(arm, q)
    z[1::2] = np.nan
    found = rebuilt(arm, q, z1=z[:, 0], z2=z[:, 1])
    assert np.abs(found - q).max() < RECOVERED * np.abs(q[:, 2:]).max()
