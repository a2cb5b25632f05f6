"""The parts of a diagnosis, each against an independent way to the same figure."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.arm.arm import Arm, Segment
from flexgui.core.diagnose.gram_matrix import explained_by, gram_matrix
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.effects.sizes import typical
from flexgui.core.estimate.minimum import converge, with_enough_substeps
from flexgui.core.estimate.problem import FitData, problem_of
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.unknowns import Unknown
from flexgui.core.least_squares import BoundsAndPrior, levenberg_marquardt
from flexgui.core.model import Model
from flexgui.core.noise.sensor_noise import noise_of
from flexgui.core.noise.whitening import no_whitening
from flexgui.core.parameters import Parameter
from flexgui.core.sensors import sensor
from tests.helpers import from_rest, read, simulate_fixed

ROUNDING = 1e-8
"""Relative: small dense problems, solved two ways."""


Problem = tuple[list[np.ndarray], list[np.ndarray], list[list[np.ndarray]]]


def problem(seed: int, P: int = 3, Q: int = 4) -> Problem:
    """Residuals (M, k), slopes (M, k, P) and Q columns for two recordings."""
    rng = np.random.default_rng(seed)
    shapes = [(40, 2), (30, 2)]
    residuals = [rng.standard_normal(s) for s in shapes]
    slopes = [rng.standard_normal((*s, P)) for s in shapes]
    columns = [[rng.standard_normal(s) for s in shapes] for _ in range(Q)]
    return residuals, slopes, columns


KNOWN = 1e-6
"""Deviation of a parameter that is as good as stated; the recordings alone show it within .1."""


def stacked(residuals: list, slopes: list, columns: list) -> tuple[np.ndarray, ...]:  # type: ignore[type-arg]
    r = np.concatenate([x.ravel() for x in residuals])
    S = np.concatenate([x.reshape(-1, x.shape[-1]) for x in slopes])
    G = np.stack([np.concatenate([x.ravel() for x in c]) for c in columns], axis=1)
    return r, S, G


@given(st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_the_explained_drop_is_that_of_least_squares_with_the_nuisance_beside(seed: int) -> None:
    residuals, slopes, columns = problem(seed)
    r, S, G = stacked(residuals, slopes, columns)

    def left(A: np.ndarray) -> float:
        return float(np.sum((r - A @ np.linalg.lstsq(A, r, rcond=None)[0]) ** 2))

    found = gram_matrix(residuals, slopes, columns, no_whitening).projected()
    for some in ([0, 2], [2]):
        explained = explained_by(found, some, [False] * len(some))
        expected = left(S) - left(np.column_stack([S, G[:, some]]))
        assert explained.cost_reduction == pytest.approx(expected, rel=ROUNDING, abs=1e-7)


@given(st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_a_one_sided_size_is_never_negative_and_explains_no_more_than_a_free_one(seed: int) -> None:
    found = gram_matrix(*problem(seed), no_whitening).projected()
    for some, one_sided in (([0, 1, 3], [True, False, True]), ([0], [True])):
        free = explained_by(found, some, [False] * len(some))
        fixed = explained_by(found, some, one_sided)
        assert fixed.coefficients[0] >= 0.0 and fixed.coefficients[-1] >= 0.0
        assert fixed.cost_reduction <= free.cost_reduction * (1.0 + ROUNDING) + 1e-9


@given(st.integers(0, 10**6))
@settings(max_examples=10, deadline=None)
def test_a_nuisance_that_is_known_hides_no_effect(seed: int) -> None:
    """Known, it is as good as no nuisance; otherwise it explains what the effect does."""
    residuals, slopes, columns = problem(seed)
    slopes[0][..., 0], slopes[1][..., 0] = columns[0]  # the same direction as the effect

    def reduction(slopes: list[np.ndarray], deviations: float | np.ndarray) -> float:
        P = slopes[0].shape[-1]
        limits = BoundsAndPrior(-np.ones(P), np.ones(P), np.ones(P), np.zeros(P), deviations)
        prior = limits.prior_measurements(np.zeros(P))
        projected = gram_matrix(residuals, slopes, columns, no_whitening, prior).projected()
        return explained_by(projected, [0], [False]).cost_reduction

    known = np.full(slopes[0].shape[-1], np.inf)
    known[0] = KNOWN
    without = [S[..., 1:] for S in slopes]
    assert reduction(slopes, known) == pytest.approx(reduction(without, np.inf), rel=1e-6, abs=1e-6)
    assert reduction(slopes, np.inf) == pytest.approx(0.0, abs=1e-6)


def test_a_column_that_moves_nothing_explains_nothing() -> None:
    residuals, slopes, columns = problem(1)
    columns[0] = [np.zeros_like(x) for x in columns[0]]
    found = explained_by(
        gram_matrix(residuals, slopes, columns, no_whitening).projected(), [0], [True]
    )
    assert found.cost_reduction == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.isfinite(found.coefficients))


def rosenbrock(x: np.ndarray) -> list[np.ndarray]:
    return [np.array([[10.0 * (x[1] - x[0] ** 2)], [1.0 - x[0]]])]


def rosenbrock_slopes(x: np.ndarray) -> list[np.ndarray]:
    return [np.array([[[-20.0 * x[0], 10.0]], [[-1.0, 0.0]]])]


@pytest.mark.parametrize(("upper", "end"), [(5.0, (1.0, 1.0)), (0.5, (0.5, 0.25))])
def test_the_descent_reaches_the_bottom_of_a_curved_valley_or_stops_at_a_bound(
    upper: float, end: tuple[float, float]
) -> None:
    limits = BoundsAndPrior(np.full(2, -5.0), np.array([upper, 5.0]), np.ones(2))
    found = levenberg_marquardt(
        rosenbrock, rosenbrock_slopes, np.array([-1.2, 1.0]), limits, most=200, good_enough=0.0
    )
    assert found.vector == pytest.approx(end, abs=1e-6)


SPREAD = 0.05
"""Relative: four standard deviations of a noise estimate from ten thousand samples."""


@pytest.mark.parametrize("motion", [0.0, 5.0])
def test_the_noise_is_found_beside_a_smooth_motion_with_jumps(motion: float) -> None:
    rng = np.random.default_rng(3)
    t = np.arange(10_000) * 1e-3
    smooth = motion * np.sin(7.0 * t) + 0.5 * motion * (t > 4.0)
    assert noise_of(smooth + 0.01 * rng.standard_normal(len(t))) == pytest.approx(0.01, rel=SPREAD)


STEP, SAMPLES = 5e-3, 200
SWINGS = {"at half the sampling rate": 3300.0, "slowly": 3.3}
"""N m2: the stiffness of a link of 0.45 m, of which it swings at some 100 or 3 Hz."""

EXACTLY = 128
"""Steps per sample: twice as many move no parameter any more."""

FLOOR = 1e-6
"""m: the camera's noise, so small that twenty per cent of the stiffness show at both speeds."""

ENOUGH, LEFT = 0.01, 4.0
"""Relative error of the stiffness, and sum of squares in noise floors: two standard deviations of
one parameter. Twenty per cent are 800 of them and more."""


def data(EI: float) -> FitData:
    arm = Arm(segments=(Segment(length=0.45, mass=3.0, EI=EI, hub_inertia=0.05, modes=1),))
    bare = Model(arm, VelocityLoop(gains=(7.2,)), "nonlinear")
    rng = np.random.default_rng(1)
    speeds = 0.3 * np.sign(rng.standard_normal((SAMPLES // 10, 1))).repeat(10, axis=0)
    task = from_rest(bare, [0.2], speeds, STEP)
    motion = simulate_fixed(bare, bare.numbers(), task, EXACTLY)
    camera = sensor("z")
    one = prepare(bare, read(bare, task, motion, "z", "encoder"), [camera], Processing())
    unknown = Unknown(Parameter("EI1", EI, "N m²", 0.1 * EI, 10.0 * EI))
    floors = {c.name: FLOOR for c in camera.channels(arm)}
    weights = (np.full(2, 1.0 / FLOOR),)
    return FitData(bare, (one,), (unknown,), weights, floors, {}, typical(arm), 1)


@pytest.mark.parametrize("share", [0.8, 1.2])
@pytest.mark.parametrize("swings", SWINGS)
def test_a_stiffness_is_found_however_fast_its_link_vibrates(swings: str, share: float) -> None:
    of, EI = data(SWINGS[swings]), SWINGS[swings]
    of = with_enough_substeps(of, (), {"EI1": share * EI})
    start = problem_of(of, (), {"EI1": share * EI})
    _, found = converge(of, start, None, lambda: False)
    assert found.problem.values()["EI1"] == pytest.approx(EI, rel=ENOUGH)
    assert found.cost < LEFT
