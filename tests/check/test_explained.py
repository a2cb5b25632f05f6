"""Recordings in which a fitted model leaves no channel that could be wrong."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flexgui.core.check.run_checks import explained_by
from flexgui.core.results import ChannelComparison, RecordingComparison

SAMPLES, NOISE = 3000, 1e-5
TIME = 1e-3 * np.arange(SAMPLES)
MODEL = 1e-3 * (np.sin(40.0 * TIME) + np.sin(7.0 * TIME))


def comparison(change: Callable[[np.ndarray], np.ndarray], channel: str) -> RecordingComparison:
    """A model, and what is measured of a channel that differs from it."""
    measured = change(MODEL) + NOISE * np.random.default_rng(0).standard_normal(SAMPLES)
    every = np.ones(SAMPLES, dtype=bool)
    own = ChannelComparison(channel, "m", TIME, measured, MODEL, every)
    return RecordingComparison("r", "estimate", "fit", (own,))


def test_white_noise_leaves_nothing_to_look_for() -> None:
    assert explained_by([comparison(lambda y: y, "z1")]) == {"r"}


WRONG = {
    "late by three samples": lambda y: np.interp(TIME - 3e-3, TIME, y),
    "a factor of 1.1": lambda y: 1.1 * y,
    "shifted by a tenth of a millimetre": lambda y: y + 1e-4,
    "another sign": np.negative,
}


@pytest.mark.parametrize("change", WRONG.values(), ids=WRONG)
def test_a_wrong_channel_is_never_explained(change: Callable[[np.ndarray], np.ndarray]) -> None:
    assert explained_by([comparison(change, "z1")]) == set()


def test_computed_outputs_are_no_columns_of_a_file() -> None:
    assert explained_by([comparison(np.negative, "ydot1")]) == set()
    both = (*comparison(lambda y: y, "z1").channels, *comparison(np.negative, "ydot1").channels)
    assert explained_by([RecordingComparison("r", "estimate", "fit", both)]) == {"r"}
