"""The stated standard deviation is the one that repeated experiments show."""

from __future__ import annotations

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from flexgui.core.experiments.identified_model import IdentifiedModel
from flexgui.core.identify.uncertainty import (
    autocovariance,
    bandwidth,
    covariance,
)
from flexgui.core.least_squares import SEEN
from tests.identify.helpers import EI, LPV, clean, fit, with_channels

AGREES = 0.25
"""Relative, of the stated deviation; 150 repetitions know the true one to 6 %."""

MISLED = 0.5
"""The white formula is off by more than this where the residuals are coloured."""

REPEATS = 150
SAMPLES = 2000


def coloured(seed: int, samples: int, pole: float, mix: float) -> np.ndarray:
    """(samples, 2) of unit variance: AR(1) with that pole, channels correlated by `mix`."""
    draws = np.random.default_rng(seed).standard_normal((samples + 500, 2))
    settled = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], draws, axis=0)[500:]
    return settled @ np.array([[1.0, 0.0], [mix, np.sqrt(1.0 - mix**2)]]).T


class Deviations(NamedTuple):
    """Of two estimates, each (2,)."""

    true: np.ndarray
    stated: np.ndarray
    white: np.ndarray


def regression() -> np.ndarray:
    """S (samples, 2, 2): two slow regressors seen by two channels."""
    t = 1e-3 * np.arange(SAMPLES)
    first = np.column_stack([np.sin(6 * t), np.cos(9 * t)])
    second = np.column_stack([np.sin(6 * t + 0.5), np.sin(20 * t)])
    return np.stack([first, second], axis=1)


ALL = np.ones((SAMPLES, 2), dtype=bool)


def repeated(pole: float, mix: float, counts: np.ndarray = ALL) -> Deviations:
    """Linear regressions of noise, over and over; of the samples that count (samples, 2)."""
    S = regression() * counts[:, :, None]
    flat = S.reshape(-1, 2)
    inverse = np.linalg.inv(flat.T @ flat)
    found, stated, white = [], [], []
    for seed in range(REPEATS):
        e = coloured(seed, SAMPLES, pole, mix) * counts
        x = inverse @ flat.T @ e.ravel()
        r = e - S @ x
        found.append(x)
        stated.append(np.sqrt(np.diag(covariance([S], [r], [counts], 2))))
        white.append(np.sqrt(np.diag(inverse) * r.var()))
    return Deviations(
        np.std(found, axis=0, ddof=1), np.median(stated, axis=0), np.median(white, axis=0)
    )


@pytest.mark.parametrize("pole, mix", [(0.0, 0.0), (0.0, 0.8), (0.5, 0.5), (0.9, 0.5), (0.98, 0.7)])
def test_the_stated_deviation_is_the_true_one(pole, mix):
    found = repeated(pole, mix)
    assert found.stated == pytest.approx(found.true, rel=AGREES)


PLACES = np.arange(SAMPLES)
EDGES = np.column_stack(2 * [np.abs(PLACES - SAMPLES // 2) < SAMPLES // 4])
GAPS = np.column_stack([PLACES % 200 < 50, PLACES % 200 < 100])
"""Samples that count (samples, 2): the middle half; a quarter of one channel, half of the other."""


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("counts", [EDGES, GAPS], ids=["edges", "gaps"])
def test_samples_that_do_not_count_make_no_deviation_smaller(pole, counts):
    found = repeated(pole, 0.5, counts)
    assert found.stated == pytest.approx(found.true, rel=AGREES)


SLOW = np.column_stack(2 * [PLACES % 10 == 0])
"""Of a camera that has a tenth of the samples."""


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_a_slow_sensor_whose_noise_has_a_memory_makes_no_deviation_smaller(memory):
    """`memory` from one of its samples to the next. The first lags, at which it has no samples,
    were taken for an end of it, and the deviation of slow noise came out a third of what it is."""
    found = repeated(memory ** (1.0 / 10.0), 0.5, SLOW)
    assert found.stated == pytest.approx(found.true, rel=AGREES)


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.floats(0.0, 0.8))
def test_white_residuals_give_the_usual_formula_even_where_most_are_zero(seed, zeros):
    S = regression()
    e = coloured(seed, SAMPLES, 0.0, 0.0)
    e[np.random.default_rng(seed + 1).random(e.shape) < zeros] = 0.0
    flat = S.reshape(-1, 2)
    usual = np.linalg.inv(flat.T @ flat) * e.var()
    found = covariance([S], [e], [ALL], 2)
    assert np.sqrt(np.diag(found)) == pytest.approx(np.sqrt(np.diag(usual)), rel=AGREES)


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.floats(0.0, 0.98), st.floats(-0.9, 0.9))
def test_a_covariance_is_symmetric_and_has_no_negative_direction(seed, pole, mix):
    S, e = regression()[:300], coloured(seed, 300, pole, mix)
    C = covariance([S, S], [e, 2.0 * e], [ALL[:300]] * 2, 2)
    assert np.array_equal(C, C.T)
    assert np.linalg.eigvalsh(C).min() >= -1e-12 * np.trace(C)


@settings(max_examples=30)
@given(st.integers(0, 10_000))
def test_noise_that_was_differentiated_twice_leaves_no_deviation_of_nought(seed):
    """Nearly nothing of it is slow, and a flat-topped window found less than that."""
    S = regression()[2:]
    e = np.diff(coloured(seed, SAMPLES, 0.0, 0.3), 2, axis=0)
    found = np.sqrt(np.diag(covariance([S], [e], [ALL[2:]], 2)))
    flat = S.reshape(-1, 2)
    white = np.sqrt(np.diag(np.linalg.inv(flat.T @ flat)) * e.var())
    assert np.all(found > 1e-3 * white) and np.all(found < white)


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_a_covariance_follows_the_units(seed, residual, parameter):
    S, e = regression()[:300], coloured(seed, 300, 0.5, 0.3)
    scaled = covariance([S / parameter], [e * residual], [ALL[:300]], 2)
    unscaled = covariance([S], [e], [ALL[:300]], 2)
    assert scaled == pytest.approx(unscaled * (residual * parameter) ** 2, rel=1e-6)


def test_a_direction_that_nothing_shows_gets_no_variance_from_rounding():
    S = regression()
    S = np.concatenate([S, S.sum(axis=2, keepdims=True)], axis=2)
    C = covariance([S], [coloured(1, SAMPLES, 0.5, 0.3)], [ALL], 2)
    flat = regression().reshape(-1, 2)
    assert np.trace(C) < 10.0 / np.linalg.eigvalsh(flat.T @ flat).min() * SAMPLES


@settings(max_examples=40)
@given(st.integers(10, 400), st.integers(1, 3), st.integers(0, 1000))
def test_the_window_always_ends(samples, channels, seed):
    r = np.cumsum(np.random.default_rng(seed).standard_normal((samples, channels)), axis=0)
    assert 0 <= bandwidth(r, np.ones(r.shape, dtype=bool)) <= samples


def test_silent_residuals_are_no_trouble():
    S, zero = regression(), np.zeros((SAMPLES, 2))
    assert bandwidth(zero, ALL) == 0
    assert np.array_equal(covariance([S], [zero], [ALL], 2), np.zeros((2, 2)))


@pytest.mark.parametrize("lengths", [(400, 400), (900, 60), (30, 700, 200)])
def test_no_error_of_one_recording_is_correlated_with_those_of_another(
    lengths: tuple[int, ...],
) -> None:
    """Only pairs within a recording count, so that neither their order nor a sign matters."""
    recordings = [coloured(k, M, 0.9, 0.3) + 0.5 for k, M in enumerate(lengths)]
    counted = [np.ones(r.shape, dtype=bool) for r in recordings]
    residuals = SimpleNamespace(counted=counted)
    base = SimpleNamespace(errors=recordings, problem=SimpleNamespace(residuals=residuals))
    planned = IdentifiedModel(SimpleNamespace(base=base)).errors  # type: ignore[arg-type]
    pairs = zip(reversed(recordings), reversed(counted), strict=True)
    turned = autocovariance(*[(r * (-1.0) ** k, counts) for k, (r, counts) in enumerate(pairs)])
    assert planned.width == turned.width > 0
    assert turned.gamma == pytest.approx(planned.gamma, abs=1e-12)
    alone = [np.mean(r[:, :, None] * r[:, None], axis=0) for r in recordings]
    assert planned.gamma[0] == pytest.approx(np.average(alone, axis=0, weights=lengths))


def fitted_deviations(pole: float, repeats: int) -> tuple[float, float, float]:
    """(true, stated, white) standard deviations of EI from one experiment with that noise."""
    values, stated, white = [], [], []
    for seed in range(repeats):
        r = clean()[3]
        e = 0.03 * r["ydot1"].std() * coloured(seed, len(r.time), pole, 0.6)
        moved = {f"ydot{c + 1}": r[f"ydot{c + 1}"] + e[:, c] for c in range(2)}
        fitted = fit(LPV, [with_channels(r, moved)], parameters=("EI",), output=("ydot",))
        slopes = np.concatenate([b.ravel() for b in fitted.residuals.slopes(fitted.vector)])
        rest = fitted.residuals(fitted.vector)
        values.append(fitted.vector[0])
        stated.append(fitted.fit.estimates[0].std)
        white.append(np.sqrt(rest.var() / (slopes @ slopes)))
    assert np.mean(values) == pytest.approx(EI, rel=1e-3)
    return float(np.std(values, ddof=1)), float(np.median(stated)), float(np.median(white))


REPEATED = [(0.9, 40), *[pytest.param(p, 200, marks=pytest.mark.long) for p in (0.0, 0.5, 0.9)]]


@pytest.mark.parametrize(("pole", "repeats"), REPEATED)
def test_a_fit_states_its_deviation_whatever_the_colour_of_the_noise(pole, repeats):
    true, stated, white = fitted_deviations(pole, repeats)
    assert stated == pytest.approx(true, rel=AGREES)
    assert pole < 0.9 or white < (1.0 - MISLED) * true


def test_a_parameter_without_influence_has_no_covariance():
    S = np.concatenate([regression(), np.zeros((SAMPLES, 2, 1))], axis=2)
    e = coloured(1, SAMPLES, 0.5, 0.3)
    C = covariance([S], [e], [ALL], 2)
    assert np.all(C[2] == 0.0)
    assert C[:2, :2] == pytest.approx(covariance([regression()], [e], [ALL], 2))


DIFFERENCES = 1e-5
"""What one-sided differences miss of a slope."""


@pytest.mark.parametrize("seed", range(5))
def test_a_product_is_known_as_well_where_its_factors_are_not(seed):
    draws = np.random.default_rng(seed)
    alone, e = regression()[:, :, :1], coloured(seed, SAMPLES, 0.5, 0.3)
    both = alone * np.array([1.0, 4.0])
    both[:, :, 1] += DIFFERENCES * draws.standard_normal(alone.shape[:2])
    product = covariance([alone], [e], [ALL], 1)[0, 0]
    factors = covariance([both], [e], [ALL], 1, SEEN)
    gradient = np.array([1.0, 4.0])
    assert gradient @ factors @ gradient == pytest.approx(product, rel=1e-3)
