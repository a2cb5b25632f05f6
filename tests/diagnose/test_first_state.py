"""What an estimated first state takes out of an error."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from flexgui.core.noise.noise_propagation import (
    INITIAL_STATE_CHANGE,
    initial_state_responses,
    without_responses,
)

TIMES = np.linspace(0.0, 3.0, 400)
SWINGS = np.stack([np.cos(9.0 * TIMES), np.sin(9.0 * TIMES)], axis=-1)
LARGE = np.array([[1.0, 200.0]])
"""Two channels in units of their own."""

EXACT = 1e-9


def compared(values: Mapping[str, float]) -> np.ndarray:
    """(M, 2): both channels swing by the first state."""
    swing = SWINGS @ np.array([values["start_v1_1"], values["start_dv1_1"]])
    return swing[:, None] * LARGE + values["EI"]


VALUES: dict[str, float] = {"EI": 3.0, "start_v1_1": 0.2, "start_dv1_1": -0.4}


def answers_of() -> np.ndarray:
    answers = initial_state_responses(VALUES, compared(VALUES), compared)
    assert answers is not None
    return answers


def test_a_first_state_is_changed_a_little_and_nothing_else() -> None:
    answers = answers_of()
    assert answers == pytest.approx(
        INITIAL_STATE_CHANGE * SWINGS[:, None, :] * LARGE[..., None], rel=1e-6
    )
    assert initial_state_responses({"EI": 3.0}, np.zeros((400, 2)), compared) is None


def test_what_it_explains_goes_and_noise_stays() -> None:
    answers = answers_of()
    noise = np.random.default_rng(0).standard_normal((len(TIMES), 2)) * 1e-3 * LARGE
    shaken = (SWINGS @ np.array([0.7, -3.0]))[:, None] * LARGE
    left = without_responses(shaken + noise, answers)
    assert np.abs(without_responses(shaken, answers)).max() < EXACT * np.abs(shaken).max()
    assert np.std(left, axis=0) == pytest.approx(np.std(noise, axis=0), rel=0.02)


def test_samples_that_nobody_took_stay_empty() -> None:
    answers = answers_of()
    shaken = (SWINGS @ np.array([0.7, -3.0]))[:, None] * LARGE
    gaps = shaken.copy()
    gaps[50:80, 1] = np.nan
    left = without_responses(gaps, answers)
    assert np.isnan(left[50:80, 1]).all() and np.isfinite(left[:50]).all()
    assert np.nanmax(np.abs(left)) < EXACT * np.abs(shaken).max()
    assert without_responses(gaps, None) is gaps


def test_a_channel_without_noise_stays_so() -> None:
    """As encoders of a simulation are, whose camera has some."""
    answers = answers_of()
    none = np.zeros((len(TIMES), 2))
    assert not without_responses(none, answers).any()
    one = np.where(np.arange(2) == 0, np.cos(9.0 * TIMES)[:, None], 0.0)
    assert np.isfinite(without_responses(one, answers)).all()
