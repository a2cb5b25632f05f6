"""Correlations of residuals in their bands, and frequency responses that were measured."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from flexgui.core.residual_analysis import residual_analysis
from flexgui.core.results import ChannelComparison, InputSignal, RecordingComparison

STEP = 1e-3
"""s"""
PULSES = (np.array([0.0, 1.0, 0.5, 0.2]), np.array([0.3, 0.1]))
"""Pulse responses from the two inputs to the output."""
LEVEL = 0.99


def recording(
    error: np.ndarray, every: int = 1, lacking: float = 0.0, seed: int = 0
) -> RecordingComparison:
    """One output that follows two coloured inputs; the model lacks a share of the first path, and
    every so many samples are measured."""
    rng, count = np.random.default_rng(seed), len(error)
    u = lfilter([1.0], [1.0, -0.95], rng.standard_normal((2, count)), axis=1)
    u[1] += 0.5 * u[0]
    parts = [np.convolve(x, pulse)[:count] for x, pulse in zip(u, PULSES, strict=True)]
    whole, time = parts[0] + parts[1], np.arange(count) * STEP
    counted = np.arange(count) % every == 0
    model = whole - lacking * parts[0]
    channel = ChannelComparison("theta1", "rad", time, whole + error, model, counted)
    inputs = tuple(InputSignal(f"dtheta{k + 1}_ref", "rad/s", u[k]) for k in range(2))
    return RecordingComparison("r", "estimate", "fit", (channel,), inputs=inputs)


def noise(count: int, seed: int, pole: float = 0.0) -> np.ndarray:
    white = np.random.default_rng(100 + seed).standard_normal(count)
    return np.asarray(lfilter([1.0], [1.0, -pole], white))


@pytest.mark.parametrize("every", [1, 8])
def test_of_white_noise_one_lag_in_a_hundred_lies_outside_its_band(every: int) -> None:
    shares = [
        c.outside
        for seed in range(60)
        for c in residual_analysis(
            [recording(noise(500 * every, seed), every, seed=seed)]
        ).correlations
    ]
    assert np.mean(shares) == pytest.approx(1.0 - LEVEL, abs=0.005)  # 4 deviations of 4,500 lags


def test_coloured_noise_is_correlated_with_itself_and_not_with_the_inputs() -> None:
    shares: dict[str, list[float]] = {}
    for seed in range(40):
        found = residual_analysis([recording(noise(2000, seed, 0.9), seed=seed)])
        for c in found.correlations:
            shares.setdefault(c.input, []).append(c.outside)
    assert np.mean(shares.pop("")) > 0.5
    # Neighbouring lags are one event: fewer independent ones than above.
    assert np.mean(list(shares.values())) == pytest.approx(1.0 - LEVEL, abs=0.02)


def test_dynamics_that_the_model_lacks_are_correlated_with_their_input() -> None:
    found = residual_analysis([recording(noise(2000, 1), lacking=0.2)])
    by_input = {c.input: c for c in found.correlations}
    assert by_input["dtheta1_ref"].outside > 0.5
    first = by_input["dtheta1_ref"]
    assert STEP <= first.lag[int(np.argmax(np.abs(first.value)))] <= 3.0 * STEP  # as PULSES


def test_lags_are_multiples_of_the_outputs_own_sampling() -> None:
    own = residual_analysis([recording(noise(1600, 1), every=8)], lags=5).correlations[0]
    assert own.lag == pytest.approx(8 * STEP * np.arange(1, 6))


def test_the_measured_response_is_that_of_the_machine_from_each_input_alone() -> None:
    found = residual_analysis([recording(0.1 * noise(20_000, 1, 0.5))])
    assert [r.input for r in found.responses] == ["dtheta1_ref", "dtheta2_ref"]
    for r, pulse in zip(found.responses, PULSES, strict=True):
        turns = np.exp(-2j * np.pi * r.frequency * STEP)
        true = np.polynomial.polynomial.polyval(turns, pulse)
        below = (r.frequency > 5.0) & (r.frequency < 50.0)
        # A segment's window smears what changes within its resolution.
        assert np.abs(r.model - true)[below].max() < 0.05 * np.abs(true).max()
        assert np.median(np.abs(r.measured - true)[below]) < 0.05 * np.abs(true).max()
        assert r.coherence[below].min() > 0.99


def test_where_samples_are_missing_there_is_no_response() -> None:
    whole = recording(noise(2000, 1))
    (channel,) = whole.channels
    channel.measured[1000] = np.nan
    assert residual_analysis([whole]).responses == ()


def test_too_few_samples_have_no_correlation() -> None:
    assert residual_analysis([recording(noise(50, 1))]).correlations == ()
