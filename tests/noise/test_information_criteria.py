"""AIC, BIC and FPE of whitened errors, and the evidence that is their difference."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import multivariate_normal

from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.stated_results import Noise
from flexgui.core.estimate.fit_result import with_whitened_cost
from flexgui.core.information_criteria import added_up, fall_of_bic, information_criteria
from flexgui.core.noise.whitening import error_products
from flexgui.core.results import Diagnosis, ErrorProducts, InformationCriteria, Outcome
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.workbench import run_scenario
from flexgui.sentences.figures import criteria_text
from flexgui.views.headline import criteria
from tests.diagnose.fits import begun
from tests.diagnose.test_run import text

COUNT, LAGS, POLE = 400, 6, 0.9
"""Samples of made-up errors, samples before each that are kept, and the pole of coloured ones."""

NEARLY_WHITE = 5e-3
"""Relative: 20,000 samples know correlations within 0.7 %, of which a likelihood has the square."""

ROUNDED = 1e-9
"""Relative, of differences of sums."""

SAME_EVIDENCE = 0.05
"""Relative, of another estimator of the same autoregression."""


def products(errors: np.ndarray, parameters: int = 0, variance: float = 1.0) -> ErrorProducts:
    """Of one channel's errors (N,), by loops over what the definition says."""
    rows = [errors[k - LAGS : k + 1][::-1] for k in range(LAGS, len(errors))]
    total = sum((np.outer(row, row) for row in rows), np.zeros((LAGS + 1, LAGS + 1)))
    return ErrorProducts(total[None], np.array([len(rows)]), np.array([variance]), parameters)


def white(seed: int, count: int = COUNT) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(count)


def coloured(seed: int, count: int = COUNT) -> np.ndarray:
    return np.asarray(lfilter([1.0], [1.0, -POLE], white(seed, count)))


def of(errors: ErrorProducts, noise: ErrorProducts | None = None) -> InformationCriteria:
    found = information_criteria(errors, noise)
    assert found is not None
    return found


def polynomial(order: int, seed: int) -> ErrorProducts:
    """Errors of the best polynomial of an order, of a cubic with white noise."""
    x = np.linspace(-1.0, 1.0, COUNT)
    y = x - 2.0 * x**3 + 0.2 * white(seed)
    left = y - np.polynomial.Polynomial.fit(x, y, order)(x)
    return products(left, order + 1, float(np.var(y)))


def test_of_white_errors_they_are_what_a_normal_likelihood_gives() -> None:
    noise, parameters = white(100, 20_000), 4
    known = products(noise)
    for seed in range(20):
        errors = white(seed)
        found, own = of(products(errors, parameters), known), errors[LAGS:]
        likelihood = multivariate_normal(0.0, np.mean(noise**2)).logpdf(own).sum()
        assert found.samples == len(own)
        assert found.aic == pytest.approx(-2.0 * likelihood + 2.0 * parameters, rel=NEARLY_WHITE)
        assert found.bic - found.aic == pytest.approx(parameters * (np.log(found.samples) - 2.0))


def test_of_coloured_errors_the_likelihood_is_that_of_their_autoregression() -> None:
    """Against the dense covariance of a long series, whose beginning hardly counts."""
    errors = coloured(1)
    found = of(products(errors), products(coloured(2, 20_000)))
    lags = np.abs(np.subtract.outer(np.arange(COUNT), np.arange(COUNT)))
    dense = multivariate_normal(np.zeros(COUNT), POLE**lags / (1.0 - POLE**2))
    per_sample = -2.0 * dense.logpdf(errors) / COUNT
    assert found.aic / found.samples == pytest.approx(per_sample, rel=0.02)  # of LAGS in COUNT


def test_a_fall_of_bic_is_the_difference_of_two_and_adds_up_over_three() -> None:
    """Whatever the noise, which is one."""
    noise = products(coloured(0))
    first, second, third = (products(coloured(k) * k, 2 * k) for k in (3, 2, 1))
    one = fall_of_bic(first, second, noise)
    assert one == pytest.approx(of(first, noise).bic - of(second, noise).bic, rel=ROUNDED)
    whole, other = fall_of_bic(first, third, noise), fall_of_bic(second, third, noise)
    assert one is not None and other is not None
    assert whole == pytest.approx(one + other, rel=ROUNDED)
    assert fall_of_bic(None, second, noise) is None and fall_of_bic(first, second, None) is None


def test_the_unit_of_an_output_moves_no_difference() -> None:
    noise, first, second = (products(coloured(k)) for k in range(3))
    metres = fall_of_bic(first, second, noise)
    small = [replace(p, products=1e6 * p.products) for p in (first, second, noise)]
    assert fall_of_bic(*small) == pytest.approx(metres, rel=1e-6)


def test_errors_that_are_correlated_speak_less_for_a_parameter_than_white_ones() -> None:
    """A sine that is slower than the noise: in coloured noise its samples say the same again."""
    wave = 0.5 * np.sin(2.0 * np.pi * 3.0 * np.arange(COUNT) / COUNT)
    falls = [
        fall_of_bic(products(noise + wave), products(noise, 1), products(noise))
        for noise in (white(1), coloured(1) * np.sqrt(1.0 - POLE**2))
    ]
    assert falls[0] is not None and falls[1] is not None and falls[0] > 5.0 * falls[1]


def test_the_final_prediction_error_is_that_on_other_noise() -> None:
    """Of a model with 20 parameters: its own error is less, that on unseen noise more."""
    x, foreseen, unseen = np.linspace(-1.0, 1.0, COUNT), [], []
    for seed in range(200):
        y, other = white(seed), white(10_000 + seed)
        model = np.polynomial.Polynomial.fit(x, y, 19)(x)
        foreseen.append(of(products(y - model, 20)).fpe)
        unseen.append(np.mean((other - model) ** 2))
    # AIC's orders of white noise foretell a per cent too much.
    assert np.mean(foreseen) == pytest.approx(np.mean(unseen), rel=0.03)


def test_bic_finds_the_order_of_the_model() -> None:
    orders = []
    for seed in range(50):
        noise = polynomial(6, seed)
        bics = [of(polynomial(n, seed), noise).bic for n in range(1, 7)]
        orders.append(1 + int(np.argmin(bics)))
    assert np.mean(np.array(orders) == 3) > 0.9  # it is consistent, not certain, of 400 samples


def test_too_little_to_compare_has_no_criteria() -> None:
    assert information_criteria(products(white(1), COUNT)) is None
    assert information_criteria(products(np.zeros(COUNT))) is None
    assert information_criteria(products(white(1), variance=0.0)) is None
    rarely = ErrorProducts(np.zeros((1, 7, 7)), np.zeros(1), np.ones(1), 0)
    assert information_criteria(rarely) is None


def test_fits_of_one_recording_each_count_as_one_model() -> None:
    both = added_up([products(white(1), 2), products(white(2), 3)])
    assert both.parameters == 5 and both.samples == 2 * (COUNT - LAGS)
    joined = products(white(1)).products + products(white(2)).products
    assert both.products == pytest.approx(joined)


@cache
def ladder() -> Outcome:
    """A diagnosis that adds two effects."""
    kinds = '["coulomb_friction", "tip_payload", "viscous_friction"]'
    document = text(diagnose=f"[diagnose]\ncandidates = {kinds}\nmax_effects = 2")
    hidden = "hidden = { tip_payload = { mt2 = 0.4 }, "
    return run_scenario(parse_scenario(document.replace("hidden = { ", hidden), "x"))


def diagnosis() -> Diagnosis:
    found = ladder().diagnosis
    assert found is not None
    return found


def test_every_step_of_a_ladder_falls_by_the_evidence_for_its_effect() -> None:
    found = diagnosis()
    assert {s.added for s in found.steps} == {None, "coulomb_friction", "tip_payload"}
    bics = []
    for step in found.steps:
        assert step.left is not None
        bics.append(of(step.left, found.noise).bic)
    for k, step in enumerate(found.steps[1:]):
        (added,) = (r for r in found.rounds[k].ranking if r.effect == step.added)
        assert added.delta_bic == pytest.approx(bics[k] - bics[k + 1], rel=ROUNDED)
    shown = criteria(ladder())
    assert shown is not None and shown.bic == bics[-1]


def test_what_was_not_added_is_measured_by_the_same_noise() -> None:
    found, compared = diagnosis(), 0
    for before, tried in zip(found.steps, found.rounds, strict=False):
        for ranked in (r for r in tried.ranking if r.effect != tried.accepted and r.left):
            fall = fall_of_bic(before.left, ranked.left, found.noise)
            assert ranked.delta_bic == pytest.approx(fall, rel=ROUNDED)
            compared += 1
    assert compared > 0


@cache
def fitted() -> tuple[BaseFit, Noise]:
    """The model as given of a short recording, and its error as noise."""
    base = begun(parse_scenario(text(), "x"))
    return base, Noise.of(base.data, base.base.errors)


def test_products_are_those_of_the_errors_in_their_units() -> None:
    base, _ = fitted()
    data, errors = base.data, base.base.errors
    found = error_products(data.experiments, errors, data.weights, 3)
    for c in range(len(data.weights[0])):
        counted = data.experiments[0].counted[:, c]
        own = products(errors[0][counted, c] / data.weights[0][c])
        assert found.products[c] == pytest.approx(own.products[0], rel=1e-6)
        measured = data.experiments[0].measured[counted, c]
        assert found.variance[c] == pytest.approx(np.var(measured))


def test_the_whitened_cost_of_a_refit_says_the_same() -> None:
    """The search decides by whitened series, the report by their products."""
    base, noise = fitted()
    data, refit = base.data, base.base
    shrunk = replace(refit.descended, blocks=tuple(0.5 * r for r in refit.errors))
    other = replace(refit, descended=shrunk)
    a, b = (with_whitened_cost(r, noise.whitener).whitened_cost for r in (refit, other))
    left = (noise.left(data, r) for r in (refit, other))
    assert fall_of_bic(*left, noise.products) == pytest.approx(a - b, rel=SAME_EVIDENCE)


def test_criteria_are_written_to_the_unit_and_huge_ones_to_three_digits() -> None:
    ordinary = InformationCriteria(-18804.26, -18793.4, 0.004, 4000, 4)
    assert criteria_text(ordinary) == "AIC −18804, BIC −18793, FPE 0.004"
    told = criteria_text(replace(ordinary, aic=4852492322.0, bic=4852492388.0))
    assert told == "AIC 4.85 × 10⁹, BIC 4.85 × 10⁹, FPE 0.004"
    assert criteria_text(None) == ""
