"""Rules of a line or two, each of which once hid something."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core import linear_or_nonlinear
from flexgui.core.diagnose.evidence import RefittedCandidate, price, ranked_candidates
from flexgui.core.diagnose.search_round import still_competitive
from flexgui.core.effects import effect
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.noise.repeated_motions import Group, Stretch, repeated_groups, unrepeated_rms
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.sensors import sensor
from tests.noise import floors


@pytest.mark.parametrize("kind, moved", [("ydot", np.sqrt(2.0)), ("y", 0.0), ("z", 0.0)])
def test_only_places_drift_from_cycle_to_cycle(kind: str, moved: float) -> None:
    """The means of a speed's cycles are its noise; the rule went by the first letter."""
    recording = floors.clean(1e-3, 1.0, "prbs", 1)
    e = prepare(floors.BARE, recording, [sensor(kind)], Processing())
    half = len(e.measured) // 2
    block = np.ones_like(e.measured)
    block[half:] = -1.0
    found = unrepeated_rms([Group((Stretch(0, 0), Stretch(0, half)), half)], [e], [block])
    assert list(found.values()) == pytest.approx([moved, moved])


@pytest.mark.parametrize("decimate", [1, 2, 5, 7])
@pytest.mark.parametrize("period", [200, 202, 205, 210, 211])
def test_an_error_that_repeats_exactly_is_no_noise_whatever_is_decimated(
    period: int, decimate: int
) -> None:
    """Cycles that were not whole compared samples were compared at different instants."""
    recording = floors.clean(1e-3, 2.0, "prbs", 1)
    e = prepare(floors.BARE, recording, [sensor("z")], Processing(decimate=decimate))
    draws = np.random.default_rng(period).standard_normal((2, 3 * period))
    smooth = ZeroPhaseLowPass(cutoff_hz=20.0).apply(draws[0], 1e-3)[period : 2 * period]
    references = np.resize(smooth, (len(recording.time), 1)) * np.ones(2)
    e = replace(e, task=replace(e.task, references=references))
    error = np.resize(draws[1, :period], (len(recording.time), 1))[::decimate] * np.ones(2)
    groups = repeated_groups([e])
    assert groups or period % decimate
    assert all(rms < 1e-12 for rms in unrepeated_rms(groups, [e], [error]).values())


def test_a_channel_without_a_number_decides_the_level(monkeypatch: Any) -> None:
    """The next channel's ratio took its place."""
    recording = floors.clean(1e-3, 1.0, "prbs", 1)
    known = defaultdict(lambda: SimpleNamespace(value=1.0), z1=SimpleNamespace(value=np.nan))
    monkeypatch.setattr(linear_or_nonlinear, "channel_floors", lambda *_: known)
    found = linear_or_nonlinear.choose_level(
        floors.BARE, [sensor("z")], Processing(), [recording], {}, 1e-3
    )
    assert found.level == "nonlinear" and found.channel == "z1"


SAMPLES = 1000
LARGE, SMALLER = 5000.0, 4000.0
"""Of evidence: far more than a tie apart."""


def weighed(kind: str, gain: float, explained: float = 30.0) -> RefittedCandidate:
    return RefittedCandidate(
        screened=cast(Any, SimpleNamespace(effect=effect(kind))),
        refit=cast(Any, None),
        parameters=1,
        reduction=0.5,
        explained=explained,
        whitened_reduction=gain,
        gain=gain,
        p_value=0.0,
    )


@pytest.mark.parametrize(
    ("first", "second"),
    [
        pytest.param(
            weighed("torque_ripple", LARGE), weighed("tip_payload", SMALLER),
            id="the larger fall of the extended BIC",
        ),
        pytest.param(
            weighed("torque_ripple", SMALLER), weighed("tip_payload", LARGE, explained=0.01),
            id="what is relevant before what is only significant",
        ),
        pytest.param(
            weighed("coulomb_friction", SMALLER), weighed("stribeck_friction", LARGE, 30.03),
            id="a part that explains as much before the whole",
        ),
        pytest.param(
            weighed("stribeck_friction", LARGE, 33.0), weighed("coulomb_friction", SMALLER),
            id="the whole where its part leaves relevantly more",
        ),
    ],
)  # fmt: skip
def test_what_comes_first(first: RefittedCandidate, second: RefittedCandidate) -> None:
    assert ranked_candidates([second, first]) == [first, second]


@given(st.integers(1, 20), st.integers(100, 10**6), st.floats(1.0, 1e6))
def test_more_parameters_and_more_choices_cost_more(p: int, count: int, choices: float) -> None:
    asked = price(p, count, choices)
    assert price(p + 1, count, choices) == pytest.approx(asked + np.log(count))
    assert price(p, count, np.e * choices) == pytest.approx(asked + 2.0)


def runner(left: float, bound: float) -> Any:
    """One that left a share of the error above the floor and hopes to leave another."""
    costs = [(1.0 + 100.0 * share) * SAMPLES for share in (left, bound)]
    return SimpleNamespace(refit=SimpleNamespace(cost=costs[0]), bound=costs[1])


def going(*runners: Any) -> list[bool]:
    return still_competitive(runners, SAMPLES)


def test_who_is_far_behind_goes_on_only_where_the_next_step_may_change_that() -> None:
    assert going(runner(0.03, 0.03), runner(0.6, 0.55), runner(0.6, 0.02)) == [True, False, True]


def test_where_nobody_leads_everybody_goes_on() -> None:
    assert going(runner(0.9, 0.9), runner(0.95, 0.94), runner(1.0, 0.98)) == [True] * 3


def test_what_came_apart_is_out_and_outdoes_nobody() -> None:
    astray = runner(0.5, np.inf)
    astray.refit.cost = np.inf
    assert going(runner(0.5, 0.5), astray) == [True, False]
