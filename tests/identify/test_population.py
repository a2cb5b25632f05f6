"""The fast cost of a population is the plain cost, whatever is compared and estimated."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.identify import lane_groups
from flexgui.core.identify.population_cost import PopulationCost
from flexgui.core.identify.residuals import Residuals
from flexgui.core.processors import at_most
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from tests.identify.helpers import LPV, noisy, residuals_of, simulated

EQUAL = 1e-9
"""Relative; both are the exact response, summed in another order."""


MEMBERS = 11
"""Not a multiple of any packing."""

SPREAD = 0.1
"""Relative, of the population around the start."""


def short(count: int, seconds: float = 0.3, **spec: Any) -> list[Recording]:
    """Noisy recordings at `count` points, so that no cost is near zero."""
    points = [0.4 + 2.3 * k / max(count - 1, 1) for k in range(count)]
    return noisy(simulated(LPV, points=points, seconds=seconds, **spec), 20.0, 1)


def vectors(residuals: Residuals, seed: int = 0) -> np.ndarray:
    """(MEMBERS, P) around the start; what is not searched keeps it."""
    start = residuals.unknowns.parameters.vector()
    factor = 1.0 + SPREAD * np.random.default_rng(seed).uniform(-1, 1, (MEMBERS, len(start)))
    searched = np.array([item.searched for item in residuals.unknowns.items])
    return np.where(searched, start * factor, start)


def check(recordings: list[Recording], model=LPV, **settings: Any) -> None:  # type: ignore[no-untyped-def]
    """Fast against plain, for every member."""
    residuals = residuals_of(model, recordings, **{"output": ("ydot",), **settings})
    fast = residuals.population()
    assert fast is not None
    points = vectors(residuals)
    assert fast(points) == pytest.approx(residuals.costs(points), rel=EQUAL)
    assert fast(points[:1]) == pytest.approx(residuals.costs(points[:1]), rel=EQUAL)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 7, 8, 9, 17])
def test_any_number_of_recordings(count):
    check(short(count), parameters=("epsilon", "d"))


def test_a_process_with_one_core_to_itself_gets_no_second_thread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Made before or inside: what counts is where the cost is computed."""
    residuals = residuals_of(LPV, short(3), parameters=("epsilon", "d"), output=("ydot",))
    fast, points = residuals.population(), vectors(residuals)
    assert fast is not None
    expected = fast(points)

    def second_thread() -> None:
        raise AssertionError("a second thread is asked for")

    monkeypatch.setattr(lane_groups, "_pool", second_thread)
    with at_most(1):
        made_here = residuals.population()
        assert made_here is not None
        for cost in (fast, made_here):
            assert cost(points) == pytest.approx(expected, rel=EQUAL)
    with pytest.raises(AssertionError):
        fast(points)


def test_recordings_of_different_length_and_sample_time():
    mixed = [
        *short(1, 0.3),
        replace(short(2, 0.5)[1], name="b"),
        replace(short(3, 0.2, sample_time=5e-4)[2], name="c"),
    ]
    check(mixed, parameters=("EI1", "EI2"))


@pytest.mark.parametrize("count", [3, 9])
def test_parameters_that_belong_to_a_recording(count):
    check(short(count), parameters=("EI1", "m2"), per_recording=("EI2", "m2"))


@pytest.mark.parametrize(
    "settings",
    [
        {"weights": {"ydot2": 3.0}},
        {"output": ("ydot", "deflection")},
        {"output": ("z", "encoder"), "filter": ZeroPhaseLowPass(cutoff_hz=50.0), "decimate": 3},
        {"parameters": ("l1", "lambda2", "EI")},
        {"per_recording": ("lambda1",)},
        {"parameters": ("EI1",), "start": {"EI2": 480.0, "lambda1": 55.0}},
    ],
    ids=str,
)
def test_whatever_is_compared_and_estimated(settings):
    check(short(3), **{"parameters": ("EI",), **settings})


FOLLOWED = 1e-5
"""Relative, of a cost along a recorded posture."""


def test_a_moving_schedule_is_followed_closely():
    moving = [replace(r, theta2=None) for r in short(2)]
    residuals = residuals_of(LPV, moving, parameters=("EI",), output=("ydot",))
    points, fast = vectors(residuals), residuals.population()
    assert fast is not None
    assert fast(points) == pytest.approx(residuals.costs(points), rel=FOLLOWED)


@settings(max_examples=10)
@given(st.integers(0, 1000), st.floats(0.0, 0.9), st.integers(1, 4))
def test_masks_and_missing_samples(seed, share, count):
    rng = np.random.default_rng(seed)
    holed = []
    for r in short(count):
        masks = {c: rng.random(len(r.time)) >= share for c in ("ydot1", "ydot2")}
        empty = np.where(rng.random(len(r.time)) < 0.1, np.nan, r["ydot1"])
        holed.append(replace(r, channels={**r.channels, "ydot1": empty}, counted=masks))
    check(holed, parameters=("EI",))


@pytest.mark.parametrize(
    "settings",
    [
        {"start": {"gain_ydot1": 1.1}},
        {"start": {"offset_ydot1": 0.1}},
        {"offsets": ("ydot1",), "start": {"offset_ydot1": 0.1}},
        {"start": {"start_v1_1": 0.01}},
    ],
    ids=str,
)
def test_gains_offsets_and_initial_deviations(settings):
    residuals = residuals_of(LPV, short(2), **{"parameters": ("EI",), "output": "ydot", **settings})
    predictor = residuals.predictor
    fast = PopulationCost(
        residuals.experiments, residuals.weights, residuals.unknowns, predictor.fixed
    )
    points = vectors(residuals)
    assert fast(points) == pytest.approx(residuals.costs(points), rel=EQUAL)


def test_offsets_gains_and_initial_states_are_left_to_refinement():
    residuals = residuals_of(
        LPV, short(2), parameters=("EI", "gain_ydot1"), offsets=("ydot2",), initial_state=True,
        output=("ydot",),
    )  # fmt: skip
    searched = {item.parameter.name for item in residuals.unknowns.items if item.searched}
    assert searched == {"EI"}
    points = vectors(residuals)
    fast = residuals.population()
    assert fast is not None
    assert fast(points) == pytest.approx(residuals.costs(points), rel=EQUAL)
    moved = points[0] + residuals.scales * np.array(
        [not i.searched for i in residuals.unknowns.items]
    )
    assert residuals.population(moved) is None
