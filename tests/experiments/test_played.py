"""A recording of what was planned is cut to it, and another one is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.errors import InputError
from flexgui.core.loading import as_played
from flexgui.core.recording.recording import Recording

DT = 0.002
rng = np.random.default_rng(1)
LEVELS = rng.choice([-0.3, 0.3], (50, 2)).repeat(20, axis=0)
PLAY = Recording(
    "play1", DT * np.arange(1000), {f"dtheta{k + 1}_ref": LEVELS[:, k] for k in range(2)},
    source="play1.csv",
)  # fmt: skip


def logged(before: int, after: int, noise: float = 0.0) -> Recording:
    """The logger starts before the motion and ends after it."""
    N = before + 1000 + after
    place = np.arange(N, dtype=float)
    channels = {
        name: np.pad(x, (before, after)) + noise * np.random.default_rng(2).standard_normal(N)
        for name, x in PLAY.channels.items()
    }
    time = 5.0 + DT * np.arange(N)
    return Recording("r", time, {**channels, "theta1": place}, source="recorded1.csv")


@given(st.integers(0, 400), st.integers(0, 400), st.sampled_from([0.0, 1e-3]))
def test_the_played_stretch_is_found(before: int, after: int, noise: float) -> None:
    found = as_played(logged(before, after, noise), PLAY)
    assert found["theta1"][0] == before and len(found.time) == len(PLAY.time)
    assert found.time[0] == 0.0 and found.sample_time == pytest.approx(DT)


def test_a_logger_without_references_has_those_that_were_played() -> None:
    plain = logged(0, 100)
    channels = {"theta1": plain["theta1"]}
    found = as_played(replace(plain, channels=channels), PLAY)
    assert np.array_equal(found["dtheta2_ref"], PLAY["dtheta2_ref"])
    assert len(found["theta1"]) == len(PLAY.time)


def test_a_faster_logger_sees_each_sample_held() -> None:
    fast = {n: x.repeat(2) for n, x in PLAY.channels.items()}
    doubled = Recording("r", 0.5 * DT * np.arange(2000), fast, source="recorded1.csv")
    assert len(as_played(doubled, PLAY).time) == 2000


def test_another_experiment_is_refused() -> None:
    other = logged(10, 10)
    turned = {n: -x for n, x in other.channels.items()}
    with pytest.raises(InputError, match="does not match play1.csv"):
        as_played(replace(other, channels=turned), PLAY)


def test_half_an_experiment_is_refused() -> None:
    whole = logged(0, 0)
    half = {n: x[:500] for n, x in whole.channels.items()}
    with pytest.raises(InputError, match=r"is shorter than .* play1.csv .1 s of 2 s"):
        as_played(replace(whole, time=whole.time[:500], channels=half), PLAY)
