"""Whitened noise is white, of unit size and as many samples as were recorded, whatever the sensor's
rate, gaps and memory are; chances of an effect that is not there are uniform."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from scipy.stats import chi2, kstest

from flexgui.core.noise.whitening import LEAST_GAIN, fit_whitener, thinned
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from tests.marks import long_except

N = 20_000
CHANCE_ROWS = 6000
"""Of N, of which two hundred draws take seconds."""
UNLIKELY = 0.01
"""Chance below which p-values are not called uniform."""

EVERY_ROW = np.arange(N)
TENTH = EVERY_ROW[::10]
UNEVEN = np.cumsum(np.tile([33, 33, 34], N // 100)) - 33
"""Thirty frames per second among a thousand rows."""
RNG = np.random.default_rng(8)
TWO_THIRDS = np.flatnonzero(RNG.random(N) > 1.0 / 3.0)
HALVES = EVERY_ROW[(EVERY_ROW // 500) % 2 == 0]

MEMORY_LEFT = 0.08
"""Correlation of neighbours, of 0.9 before: 0.08 is two deviations of 600 samples."""

SAMPLED = {
    "every row": EVERY_ROW, "a fourth": EVERY_ROW[::4], "a tenth": TENTH, "uneven": UNEVEN,
    "a third dropped": TWO_THIRDS, "stretches masked": HALVES,
    "a third of a slow one dropped": TENTH[RNG.random(N // 10) > 1.0 / 3.0],
}  # fmt: skip
COLOURS = {"white": 0.0, "of memory": 0.9}


def noise(seed: int, rows: np.ndarray, memory: float) -> np.ndarray:
    """(N, 1) of unit size, zero where there is no sample; `memory` is from one sample of the
    sensor to the next."""
    rng = np.random.default_rng(seed)
    usual = float(np.median(np.diff(rows)))
    number = np.concatenate([[0], np.cumsum(np.round(np.diff(rows) / usual))]).astype(int)
    drive = np.sqrt(1.0 - memory**2) * rng.standard_normal(number[-1] + 200)
    whole = scipy.signal.lfilter([1.0], [1.0, -memory], drive)[199:]
    x = np.zeros((N, 1))
    x[rows, 0] = whole[number]
    return x


def chance(seed: int, rows: np.ndarray, memory: float) -> float:
    """p-value of a slow response in noise that has nothing to do with it."""
    rows = rows[rows < CHANCE_ROWS]
    x = noise(seed, rows, memory)
    t = np.arange(N) / CHANCE_ROWS
    response = np.zeros((N, 1))
    response[rows, 0] = np.sin(2.0 * np.pi * (3.0 + seed % 40) * t + seed)[rows]
    whitener = fit_whitener([x], [[rows]])
    r, d = whitener(0, x), whitener(0, response)
    return float(chi2.sf((d @ r) ** 2 / (d @ d), 1))


@pytest.mark.parametrize("rows", SAMPLED.values(), ids=SAMPLED)
@pytest.mark.parametrize("memory", COLOURS.values(), ids=COLOURS)
def test_the_whitened_cost_is_the_number_of_samples(rows: np.ndarray, memory: float) -> None:
    """Filled with zeros, white noise on a camera at a tenth of the rate cost ten times as much."""
    x = noise(1, rows, memory)
    white = fit_whitener([x], [[rows]])(0, x)
    scatter = np.sqrt(2.0 / len(rows))  # relative, of a chi-square
    assert white @ white / len(rows) == pytest.approx(1.0, abs=4.0 * scatter)
    assert abs(np.mean(white[1:] * white[:-1])) < MEMORY_LEFT


MEAN_ORDER = 2.2
"""Of first-order noise over 30 draws: AIC's mean of 1.6 and three deviations."""


@pytest.mark.parametrize("rows", SAMPLED.values(), ids=SAMPLED)
def test_gaps_add_nothing_to_the_order_of_the_noise(rows: np.ndarray) -> None:
    rows = rows[rows < CHANCE_ROWS]
    fits = [fit_whitener([noise(seed, rows, 0.9)], [[rows]]) for seed in range(30)]
    assert np.mean([f.predictions[0][0].weights.shape[1] for f in fits]) < MEAN_ORDER


def test_channels_of_different_rates_are_whitened_each_by_itself() -> None:
    fast, slow = noise(2, EVERY_ROW, 0.9), 3.0 * noise(3, TENTH, 0.0)
    both = np.hstack([fast, slow])
    white = fit_whitener([both], [[EVERY_ROW, TENTH]])(0, both)
    assert white[:N] == pytest.approx(fit_whitener([fast], [[EVERY_ROW]])(0, fast))
    assert white[N:] == pytest.approx(fit_whitener([slow], [[TENTH]])(0, slow))


def test_a_channel_without_any_sample_weighs_nothing() -> None:
    x, nothing = noise(4, EVERY_ROW, 0.5), np.zeros((N, 1))
    white = fit_whitener([np.hstack([x, nothing])], [[EVERY_ROW, EVERY_ROW[:0]]])
    assert white(0, np.hstack([x, nothing])).shape == (N,)


def test_an_autoregression_along_an_unbroken_series_is_that_filter() -> None:
    x = noise(5, EVERY_ROW, 0.9)
    one = fit_whitener([x], [[EVERY_ROW]]).predictions[0][0]
    assert one.weights[100, 0] == pytest.approx(0.9, abs=0.02)
    assert one.deviation[100] == pytest.approx(np.sqrt(1.0 - 0.9**2), rel=0.03)


@pytest.mark.parametrize(
    "sampled", long_except(("a tenth", "a third dropped"), SAMPLED), ids=lambda name: name
)
@pytest.mark.parametrize("memory", COLOURS.values(), ids=COLOURS)
def test_chances_under_nothing_hidden_are_uniform(sampled: str, memory: float) -> None:
    found = [chance(seed, SAMPLED[sampled], memory) for seed in range(200)]
    assert kstest(found, "uniform").pvalue > UNLIKELY


DT, CUTOFF_HZ = 1e-3, 20.0

SIMULATED = 1e-2
"""Of the noise: what a simulation misses, in model and response alike."""


def behind_a_filter(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(N, 1) noise and a response that has nothing to do with it, as a filter leaves them. The
    simulation's own error is in the residual and in the response: the filter left nothing there."""
    rng = np.random.default_rng(seed)
    low_pass = ZeroPhaseLowPass(cutoff_hz=CUTOFF_HZ)
    noise, response = (low_pass.apply(rng.standard_normal(4800), DT) for _ in range(2))
    rest = SIMULATED * rng.standard_normal(4800)
    inner = slice(400, -400)  # the ends of what a filter run both ways gives do not count
    return (noise + rest)[inner, None], (response + rest)[inner, None]


def chance_behind_a_filter(seed: int, apart: float) -> float:
    """p-value of the response in the noise."""
    noise, response = behind_a_filter(seed)
    whitener = fit_whitener([noise], [[thinned(np.arange(len(noise)), apart)]])
    r, d = whitener(0, noise), whitener(0, response)
    return float(chi2.sf((d @ r) ** 2 / (d @ d), 1))


def test_behind_a_filter_chances_are_uniform() -> None:
    """With all rows whitening lifts what the filter left of the simulation's error, the same in
    residual and response, to the height of the noise: a certainty out of nothing."""
    apart = 1.0 / (DT * 2.0 * ZeroPhaseLowPass(cutoff_hz=CUTOFF_HZ).reach_hz(LEAST_GAIN))
    found = [chance_behind_a_filter(seed, apart) for seed in range(100)]
    assert kstest(found, "uniform").pvalue > UNLIKELY
    assert max(chance_behind_a_filter(seed, 1.0) for seed in range(20)) < 1e-10
