"""Challenges: the same seed gives the same data, whose scenario does not name what is hidden."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.challenge.challenge import Challenge, _kinds, make_challenge
from flexgui.core.effects import catalogue, effect
from flexgui.core.errors import InputError
from flexgui.core.progress import Silent
from flexgui.core.scenario.read import scenario_toml
from flexgui.core.scenario.stated_effects import base_model
from flexgui.stages.challenge.judging import truth_lines


@pytest.fixture(scope="module")
def made() -> Challenge:
    return make_challenge(3, "hard", Silent())


def test_the_same_seed_gives_the_same_data(made: Challenge) -> None:
    again = make_challenge(3, "hard", Silent())
    assert (again.scenario, again.truth) == (made.scenario, made.truth)
    for one, other in zip(again.recordings, made.recordings, strict=True):
        assert all(np.array_equal(one[name], other[name]) for name in one.channels)


def test_there_are_seven_points_and_a_sweep(made: Challenge) -> None:
    assert [r.role for r in made.recordings] == ["estimate"] * 7 + ["validate"]
    points = [spec.theta2 for spec in made.scenario.recordings if spec.theta2 is not None]
    assert points == pytest.approx([k * np.pi / 8 for k in range(1, 8)])
    sweep = made.recordings[-1]["theta2"]
    assert sweep.max() - sweep.min() > 2.0


def test_the_model_has_no_effect_and_the_scenario_names_none(made: Challenge) -> None:
    assert not base_model(made.scenario).effects
    assert not [kind for kind in catalogue() if kind in scenario_toml(made.scenario)]


def test_two_effects_are_hidden_at_different_locations() -> None:
    for seed in range(30):
        kinds = _kinds(2, np.random.default_rng(seed))
        assert len({effect(kind).location for kind in kinds}) == 2


@pytest.mark.parametrize("seed", [4, pytest.param(1, marks=pytest.mark.long)])
def test_each_hidden_effect_is_well_above_the_noise(seed: int) -> None:
    truth = make_challenge(seed, "hard", Silent()).truth
    assert len(truth.shown) == 2 and min(truth.shown.values()) >= 1.9


def test_the_truth_says_what_is_hidden_and_how_large(made: Challenge) -> None:
    lines = truth_lines(made.truth)
    for kind in made.truth.effects:
        assert [line for line in lines if line.startswith(effect(kind).title)]
    assert any("times the noise" in line for line in lines) and "EI = " in lines[-1]


@pytest.mark.parametrize(("seed", "level", "wrong"), [(1, "esy", "'esy'"), (-1, "easy", "-1")])
def test_a_wrong_level_or_seed_is_named(seed: int, level: str, wrong: str) -> None:
    with pytest.raises(InputError, match=wrong):
        make_challenge(seed, level, Silent())
