"""Correlations of residuals in their bands, and frequency responses that were measured."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal
from scipy.signal import lfilter

from flexgui.core.errors import InputError
from flexgui.core.identify.processing import filtered
from flexgui.core.identify.repeatability import FEWEST_RUNS, repeatability
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.residual_analysis import residual_analysis
from flexgui.core.results import ChannelComparison, Estimate, InputSignal, RecordingComparison

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


INTERVAL = 2e-3
ROUNDING = 1e-12
"""Of a random walk of order ten, through up to ten sections."""


@pytest.mark.parametrize("order", [1, 2, 3, 4, 7, 10])
@pytest.mark.parametrize("shape", [(400, 1), (400, 5), (60, 2, 3)])
def test_it_is_scipys_forwards_and_backwards(order: int, shape: tuple[int, ...]) -> None:
    low_pass = ZeroPhaseLowPass(cutoff_hz=80.0, order=order)
    x = np.cumsum(np.random.default_rng(order).standard_normal(shape), axis=0)
    sections = signal.butter(order, 80.0, fs=1.0 / INTERVAL, output="sos")
    padding = low_pass.padding(len(x), INTERVAL)
    wanted = signal.sosfiltfilt(sections, x, axis=0, padlen=padding)
    np.testing.assert_allclose(filtered(low_pass, x, INTERVAL), wanted, rtol=0, atol=ROUNDING)


def test_signals_are_left_as_they_are_and_may_be_views() -> None:
    low_pass = ZeroPhaseLowPass(cutoff_hz=30.0)
    both = np.random.default_rng(1).standard_normal((300, 4))
    kept = both.copy()
    found = filtered(low_pass, both[:, ::2], INTERVAL)
    np.testing.assert_array_equal(both, kept)
    np.testing.assert_array_equal(found, filtered(low_pass, both[:, ::2].copy(), INTERVAL))


def test_a_signal_that_is_too_short_is_empty() -> None:
    low_pass = ZeroPhaseLowPass(cutoff_hz=30.0)
    few = low_pass.shortest - 1
    assert np.isnan(filtered(low_pass, np.ones((few, 2)), INTERVAL)).all()
    np.testing.assert_allclose(
        filtered(low_pass, np.ones((few + 1, 2)), INTERVAL), 1.0, atol=ROUNDING
    )


def test_a_cut_off_beyond_half_the_rate_is_refused() -> None:
    with pytest.raises(InputError, match="must be below 250 Hz"):
        filtered(ZeroPhaseLowPass(cutoff_hz=250.0), np.ones((100, 1)), INTERVAL)


SETS = 400
"""Sets of runs: a share of 0.93 is known to 0.01."""
COVERS, NAMED, FALSE = 0.93, 0.95, 0.05
RUNS = ("a", "b", "c", "d", "e")
TRUE = {"fc1": 0.5, "EI1": 2.7}


def runs(
    rng: np.random.Generator, within: float, between: float, changed: float = 0.0
) -> dict[str, list[Estimate]]:
    """Five runs; shares of the true values. Run c has another friction."""
    made = {}
    for run in RUNS:
        made[run] = []
        for name, true in TRUE.items():
            factor = 1.0 + (changed if (run, name) == ("c", "fc1") else 0.0)
            value = true * (factor + between * rng.standard_normal())
            value += within * true * rng.standard_normal()
            made[run].append(Estimate(name, value, within * true, "", True))
    return made


@pytest.mark.parametrize(("within", "between"), [(0.02, 0.0), (0.01, 0.03), (0.005, 0.005)])
def test_intervals_between_runs_hold_the_truth(within: float, between: float) -> None:
    rng, held = np.random.default_rng(1), []
    for _ in range(SETS):
        for one in repeatability(runs(rng, within, between)):
            low, high = one.interval
            held.append(low <= TRUE[one.name] <= high)
    assert np.mean(held) >= COVERS


@pytest.mark.parametrize(("within", "between"), [(0.01, 0.0), (0.01, 0.01)])
def test_a_run_with_changed_friction_is_named(within: float, between: float) -> None:
    rng, named = np.random.default_rng(2), []
    for _ in range(SETS):
        found = {one.name: one for one in repeatability(runs(rng, within, between, changed=0.2))}
        named.append([d.run for d in found["fc1"].disagreeing] == ["c"])
    assert np.mean(named) >= NAMED


@pytest.mark.parametrize(("within", "between"), [(0.02, 0.0), (0.01, 0.03)])
def test_equal_runs_are_rarely_accused(within: float, between: float) -> None:
    rng = np.random.default_rng(3)
    said = [
        any(one.disagreeing for one in repeatability(runs(rng, within, between)))
        for _ in range(SETS)
    ]
    assert np.mean(said) <= FALSE


def test_what_a_run_does_not_know_is_left_out() -> None:
    made = runs(np.random.default_rng(4), 0.02, 0.0)
    made["b"][0] = Estimate("fc1", 0.5, np.nan, "", True)
    assert [one.name for one in repeatability(made)] == ["EI1"]
    few = dict(list(made.items())[: FEWEST_RUNS - 1])
    assert repeatability(few) == ()
