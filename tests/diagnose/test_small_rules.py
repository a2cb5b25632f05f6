"""Rules of a line or two, each of which once hid something."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from flexgui.core import linear_or_nonlinear
from flexgui.core.diagnose.evidence import RefittedCandidate, ranked_candidates
from flexgui.core.diagnose.remaining_error import within_noise
from flexgui.core.diagnose.search_round import still_competitive
from flexgui.core.effects import effect
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.noise.repeated_motions import Group, Stretch, repeated_groups, unrepeated_rms
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.results import ABOVE, ABOVE_IN_ONE
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


LARGE, SMALLER = 5000.0, 4000.0
"""Of evidence: far more than a tie apart."""


def weighed(
    kind: str, reduction: float, bic: float, parameters: int, p_value: float = 0.0
) -> RefittedCandidate:
    return RefittedCandidate(
        screened=cast(Any, SimpleNamespace(effect=effect(kind))),
        refit=cast(Any, None),
        parameters=parameters,
        reduction=reduction,
        explained=30.0 * reduction,
        whitened_reduction=bic,
        delta_bic=bic,
        p_value=p_value,
    )


PRESLIDING = weighed("presliding_friction", 0.762, LARGE, 4)
"""Coulomb friction is a part of it."""


@pytest.mark.parametrize(
    ("first", "second"),
    [
        pytest.param(
            weighed("torque_ripple", 0.76, LARGE, 2), weighed("tip_payload", 0.76, SMALLER, 1),
            id="the sharper evidence where nearly the same error is left",
        ),
        pytest.param(
            weighed("coulomb_friction", 0.758, SMALLER, 2), PRESLIDING,
            id="a part that does as well by merit before the whole",
        ),
        pytest.param(
            weighed("presliding_friction", 0.67, LARGE, 4),
            weighed("coulomb_friction", 0.50, SMALLER, 2),
            id="the whole where its part leaves much more",
        ),
        pytest.param(
            PRESLIDING, weighed("coulomb_friction", 0.758, SMALLER, 2, p_value=0.5),
            id="the whole before a part that noise might be",
        ),
    ],
)  # fmt: skip
def test_what_comes_first(first: RefittedCandidate, second: RefittedCandidate) -> None:
    assert ranked_candidates([second, first]) == [first, second]


SAMPLES = 1000
GIVEN = SimpleNamespace(cost=101.0 * SAMPLES, parametrised=SimpleNamespace(unknowns=range(5)))


def runner(left: float, bound: float, own: int = 1) -> Any:
    """One that left a share of the error above the floor and hopes to leave another."""
    hypothesis = SimpleNamespace(unknowns=range(5 + own))
    costs = [(1.0 + 100.0 * share) * SAMPLES for share in (left, bound)]
    return SimpleNamespace(
        refit=SimpleNamespace(cost=costs[0], parametrised=hypothesis), bound=costs[1]
    )


def going(*runners: Any) -> list[bool]:
    return still_competitive(runners, GIVEN, SAMPLES)  # type: ignore[arg-type]


def test_who_is_far_behind_goes_on_only_where_the_next_step_may_change_that() -> None:
    assert going(runner(0.03, 0.03), runner(0.6, 0.55), runner(0.6, 0.02)) == [True, False, True]


def test_where_nobody_leads_everybody_goes_on() -> None:
    assert going(runner(0.9, 0.9), runner(0.95, 0.94), runner(1.0, 0.98)) == [True] * 3


def test_what_came_apart_is_out_and_outdoes_nobody() -> None:
    astray = runner(0.5, np.inf)
    astray.refit.cost = np.inf
    assert going(runner(0.5, 0.5), astray) == [True, False]


def test_many_parameters_count_against_a_hope() -> None:
    assert going(runner(0.5, 0.5), runner(0.7, 0.6, own=1)) == [True, True]
    assert going(runner(0.5, 0.5), runner(0.7, 0.6, own=9)) == [True, False]


def data(servo: bool = False) -> Any:
    counted = np.ones((SAMPLES, 2), dtype=bool)
    one = SimpleNamespace(channels=[("z1", "m"), ("theta1", "rad")], counted=counted)
    return SimpleNamespace(
        experiments=[one], count=2 * SAMPLES, rig=SimpleNamespace(servo=servo), law_errors={}
    )


def left(z: float, theta: float) -> list[np.ndarray]:
    """Errors of two channels with these rms, in noise floors."""
    return [np.tile([z, theta], (SAMPLES, 1)) * np.resize([1.0, -1.0], SAMPLES)[:, None]]


@pytest.mark.parametrize("servo, z, within", [
    (False, 0.95, True), (False, 1.03, False), (True, 1.03, True), (True, ABOVE + 0.02, False),
])  # fmt: skip
def test_a_servo_has_the_limit_of_the_verdict_others_the_noise_itself(
    servo: bool, z: float, within: bool
) -> None:
    assert within_noise(data(servo), left(z, z)) is within


@pytest.mark.parametrize("servo", [False, True])
def test_a_channel_that_stands_out_is_not_hidden_by_a_quiet_one(servo: bool) -> None:
    assert within_noise(data(servo), left(0.5, ABOVE_IN_ONE - 0.01))
    assert not within_noise(data(servo), left(0.5, ABOVE_IN_ONE + 0.01))


def test_a_simulation_that_went_astray_is_no_noise() -> None:
    assert not within_noise(data(), [np.full((SAMPLES, 2), np.inf)])
