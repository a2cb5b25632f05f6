"""AIC, BIC and FPE against their definitions, and that they find the order of a model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.information_criteria import information_criteria
from flexgui.core.results import ChannelComparison, RecordingComparison

COUNT = 400
TIME = np.arange(COUNT) * 1e-3


def polynomial(order: int, seed: int) -> RecordingComparison:
    """A cubic with white noise, and the best polynomial of an order."""
    x = np.linspace(-1.0, 1.0, COUNT)
    y = x - 2.0 * x**3 + 0.2 * np.random.default_rng(seed).standard_normal(COUNT)
    model = np.polynomial.Polynomial.fit(x, y, order)(x)
    channel = ChannelComparison("z1", "m", TIME, y, model, np.ones(COUNT, dtype=bool))
    return RecordingComparison("r", "estimate", "fit", (channel,))


def test_they_are_what_a_normal_likelihood_gives() -> None:
    compared, parameters = polynomial(3, 0), 4
    (c,) = compared.channels
    variance = np.mean(c.residual**2)
    logarithm = -0.5 * np.sum(np.log(2.0 * np.pi * variance) + c.residual**2 / variance)
    found = information_criteria([compared], parameters)
    assert found is not None
    assert found.aic == pytest.approx(-2.0 * logarithm + 2.0 * parameters)
    assert found.bic == pytest.approx(-2.0 * logarithm + parameters * np.log(COUNT))
    growth = (1.0 + parameters / COUNT) / (1.0 - parameters / COUNT)
    assert found.fpe == pytest.approx(variance / np.var(c.measured) * growth)


def test_the_final_prediction_error_is_that_on_other_noise() -> None:
    """Of a model with 20 parameters: its own error is less, that on unseen noise more."""
    foreseen, unseen = [], []
    for seed in range(200):
        compared, other = polynomial(19, seed), polynomial(19, 10_000 + seed)
        found = information_criteria([compared], 20)
        assert found is not None
        (c,), (d,) = compared.channels, other.channels
        foreseen.append(found.fpe * np.var(c.measured))
        unseen.append(np.mean((d.measured - c.model) ** 2))
    assert np.mean(foreseen) == pytest.approx(np.mean(unseen), rel=0.02)  # 200 x 400 samples


def test_bic_finds_the_order_of_the_model() -> None:
    orders = []
    for seed in range(50):
        found = [information_criteria([polynomial(n, seed)], n + 1) for n in range(1, 7)]
        orders.append(1 + int(np.argmin([f.bic for f in found if f is not None])))
    assert np.mean(np.array(orders) == 3) > 0.9  # it is consistent, not certain, of 400 samples


def test_recordings_that_were_not_fitted_and_outputs_that_were_not_do_not_count() -> None:
    compared = polynomial(3, 0)
    alone = information_criteria([compared], 4)
    shown = replace(compared.channels[0], channel="z2", fitted=False)
    more = replace(compared, channels=(*compared.channels, shown))
    assert information_criteria([more, replace(polynomial(1, 1), role="validate")], 4) == alone


def test_without_recordings_there_are_none() -> None:
    assert information_criteria([], 2) is None
