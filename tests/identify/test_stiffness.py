"""The paper's study: EI is found, its two factors are not, and the fit says so."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from flexgui.core.identify.fit import Fitted
from flexgui.sentences.identifiability import identifiability_sentences, invariant
from tests.helpers import PAPER, looped
from tests.identify.helpers import EI, LPV, PAIR, clean, estimate, fit, noisy, simulated
from tests.marks import long_except

EXACT = 1e-6
"""Relative: noise-free data of the same model leave only rounding."""

WRONG_START = {"epsilon": 0.85e9, "d": 0.054}
"""EI is 16 % off, so that no fit can return its start."""

DIRECTION = np.array([4.0, -1.0]) / np.sqrt(17.0)
"""epsilon d^4 stays where epsilon grows by 4 % while d shrinks by 1 %."""

DIRECTION_TOLERANCE = 1e-5
"""Truncation of the differences that make the sensitivities."""

SNR_DB = 20.0
NOISY_ERROR = 0.01
"""Relative, at 20 dB; the standard deviation is 0.1 %."""

FLAT = 1e-6
"""Of the cost along the valley, where noise makes up nearly all of it."""


def searched(seed: int) -> Fitted:
    return fit(LPV, clean(), seed=seed, generations=60, population=30, start=WRONG_START, **PAIR)


@cache
def at_20_db(seed: int) -> Fitted:
    return fit(LPV, noisy(clean(), SNR_DB, seed), start=WRONG_START, **PAIR)


def stiffness_error(fitted: Fitted) -> float:
    """Relative."""
    return estimate(fitted, "EI").value / EI - 1.0


@pytest.mark.parametrize("seed", long_except(range(5), range(20)))
def test_noise_free_data_give_the_product_from_any_seed(seed):
    fitted = searched(seed)
    assert abs(stiffness_error(fitted)) < EXACT
    assert estimate(fitted, "EI").identifiable


def test_the_factors_are_not_told_apart_and_the_words_say_so():
    fitted = at_20_db(0)
    found = fitted.fit.identifiability
    assert [estimate(fitted, n).identifiable for n in ("epsilon", "d")] == [False, False]
    assert all(np.isnan(estimate(fitted, n).std) for n in ("epsilon", "d"))
    assert found.rank == 1
    assert found.singular_values[1] < EXACT * found.singular_values[0]
    direction = found.null_directions[0] * np.sign(found.null_directions[0][0])
    assert direction == pytest.approx(DIRECTION, abs=DIRECTION_TOLERANCE)
    (sentence,) = identifiability_sentences(fitted.fit)
    assert "determine ε d⁴, not ε and d separately" in sentence


def test_the_valley_holds_the_product_and_the_cost():
    fitted = at_20_db(0)
    valley = fitted.fit.identifiability.valley
    assert valley is not None
    assert invariant(valley) == "ε d⁴"
    epsilon, d = valley.points.T
    product = epsilon * d**4 / 12.0
    assert product == pytest.approx(np.full(len(product), product[0]), rel=DIRECTION_TOLERANCE)
    assert valley.cost_ratio == pytest.approx(np.ones(len(product)), abs=FLAT)
    low, high = np.array([PAIR["bounds"][n] for n in valley.names]).T
    inside = (valley.points >= low * (1 - EXACT)) & (valley.points <= high * (1 + EXACT))
    assert inside.all()
    assert np.ptp(epsilon) > 0.9 * (high[0] - low[0])


def test_the_valley_is_flat_where_nothing_but_rounding_is_left():
    valley = searched(0).fit.identifiability.valley
    assert valley is not None
    assert valley.cost_ratio == pytest.approx(np.ones(len(valley.points)), abs=1e-3)


def test_a_held_start_of_what_is_not_estimated_counts():
    start = {"epsilon": 0.85e9, "d": 0.051}
    fitted = fit(LPV, clean(), parameters=("epsilon",), output=("ydot",), start=start)
    assert estimate(fitted, "epsilon").value == pytest.approx(EI * 12.0 / 0.051**4, rel=EXACT)


@pytest.mark.parametrize(
    ("noises", "least", "width"),
    [(8, 7, 1.6), pytest.param(50, 45, 1.3, marks=pytest.mark.long)],
)
def test_the_stated_interval_covers_the_truth_at_20_db(noises: int, least: int, width: float):
    """A deviation from eight draws is good to a quarter."""
    fits = [at_20_db(seed) for seed in range(noises)]
    errors = np.array([stiffness_error(f) for f in fits])
    half = np.array([1.96 * estimate(f, "EI").std / EI for f in fits])
    assert np.abs(errors).max() < NOISY_ERROR
    assert np.sum(np.abs(errors) < half) >= least
    assert np.median(half) < width * 1.96 * errors.std(ddof=1)


NONLINEAR_BIAS = 0.003
"""Relative, of the linear model on non-linear data with the default excitation."""


def test_the_linear_model_is_hardly_biased_by_large_motion():
    recordings = simulated(looped(PAPER), seed=1)
    assert abs(stiffness_error(fit(LPV, recordings, start=WRONG_START, **PAIR))) < NONLINEAR_BIAS


def test_a_local_fit_uses_its_own_recording_only():
    first, second = clean()[0], noisy(clean()[1:2], -20.0, 3)[0]
    alone = fit(LPV, [first], start=WRONG_START, **PAIR)
    assert abs(stiffness_error(alone)) < EXACT
    assert alone.fit.recordings == (first.name,)
    assert abs(stiffness_error(fit(LPV, [first, second], start=WRONG_START, **PAIR))) > EXACT
