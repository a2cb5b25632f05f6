"""Noise of the studies, white and coloured."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.study.study_rig import AR_COEFFICIENT, AR_COEFFICIENTS, noise

SAMPLES = 200_000
SCATTER = 0.02
"""Relative; a coloured sequence of this length has about 10 000 independent samples."""


@pytest.mark.parametrize("colour", AR_COEFFICIENTS.values())
def test_both_colours_have_the_stated_deviation(colour: float) -> None:
    x = noise(np.random.default_rng(1), SAMPLES, 3e-5, colour)
    assert np.std(x) == pytest.approx(3e-5, rel=SCATTER)


@pytest.mark.parametrize("dt", [0.5e-3, 1e-3, 4e-3])
def test_the_memory_is_one_of_time_not_of_samples(dt: float) -> None:
    x = noise(np.random.default_rng(1), SAMPLES, 1.0, AR_COEFFICIENT, dt)
    next_to_each_other = np.mean(x[1:] * x[:-1])
    assert next_to_each_other == pytest.approx(AR_COEFFICIENT ** (dt / 1e-3), abs=SCATTER)


def test_coloured_noise_is_stationary_from_the_first_sample_on() -> None:
    rng = np.random.default_rng(1)
    first = np.array([noise(rng, 20, 1.0, AR_COEFFICIENT) for _ in range(5000)])
    assert np.allclose(first.std(axis=0), 1.0, atol=0.06)  # 1 % scatter per column, 20 of them
