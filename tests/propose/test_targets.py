"""Where a law may act, what it may depend on there, and that each can be written as a formula."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy

from flexgui.core.effects.own_formula import own_parameter
from flexgui.core.effects.own_reading import own_law
from flexgui.core.estimate.fitted_model import FittedModel
from flexgui.core.propose.targets import JointTarget, Target, force_targets, targets
from flexgui.core.propose.variables import Factor, Variable, ends, share_of_bristle
from flexgui.core.trajectory import Trajectory
from tests.approved import approved
from tests.diagnose.test_stated_effects import bare
from tests.helpers import ARMS, PAPER

SUBSTEPS = 400
"""Between two samples, of an integration in small steps."""

SMALL_STEPS = 2e-3
"""Of a share: what an integration in small steps is wrong by."""

RATES = 0.02
"""Of a range: straight pieces between samples, a twentieth of a vibration apart."""


@cache
def fitted() -> FittedModel:
    """The paper's arm on one recording of encoders and camera."""
    given = bare()
    return FittedModel(given.data, given.base, ())


@cache
def motions() -> tuple[Trajectory, ...]:
    return tuple(motion for motion, _, _ in fitted().refit.problem.motions())


def named(name: str) -> Target:
    return next(target for target in targets(fitted()) if target.name == name)


@cache
def choices(name: str) -> list[tuple[Variable, Factor]]:
    return named(name).choices(fitted(), motions())


def back_and_forth(count: int = 300) -> np.ndarray:
    """A path (N,) with reversals near and far."""
    time = np.linspace(0.0, 1.0, count)
    return 0.4 * np.sin(11.0 * time) + 0.15 * np.sin(37.0 * time)


def in_small_steps(x: np.ndarray, way: float) -> np.ndarray:
    """u' = (v - |v| u) / s from u = 0, along straight pieces between the samples."""
    u, found = 0.0, [0.0]
    for move in np.diff(x) / SUBSTEPS:
        for _ in range(SUBSTEPS):
            u += (move - abs(move) * u) / way
        found.append(u)
    return np.array(found)


@pytest.mark.parametrize("way", [0.02, 0.1, 0.7])
def test_the_share_of_a_bristle_is_what_its_equation_says(way: float) -> None:
    x = back_and_forth()
    found = share_of_bristle(x, way)
    assert found == pytest.approx(in_small_steps(x, way), abs=SMALL_STEPS)
    assert np.abs(found).max() <= 1.0


def test_a_share_depends_on_the_path_and_not_on_the_pace() -> None:
    x, way = back_and_forth(), 0.1
    slow = np.interp(np.arange(0.0, len(x) - 0.75, 0.25), np.arange(len(x)), x)
    assert share_of_bristle(slow, way)[::4] == pytest.approx(share_of_bristle(x, way), abs=1e-12)
    assert share_of_bristle(50.0 * x, 5.0) == pytest.approx(share_of_bristle(x, way), abs=1e-12)
    still = np.repeat(x, 3)
    assert share_of_bristle(still, way)[::3] == pytest.approx(share_of_bristle(x, way), abs=1e-12)


def test_far_beyond_its_way_a_share_is_the_direction() -> None:
    x = np.concatenate([np.linspace(0.0, 3.0, 50), np.linspace(3.0, 0.0, 50)])
    found = share_of_bristle(x, 0.1)
    assert (found[49], found[-1]) == pytest.approx((1.0, -1.0), abs=1e-9)


def test_what_may_act_where_and_what_it_may_depend_on() -> None:
    """By factor: of a motion first that of the joint itself, then that of the others."""
    lines = []
    for target in targets(fitted()):
        lines.append(f"{target.name} [{target.unit}]")
        by_factor: dict[str, list[str]] = {}
        for x, f in choices(target.name):
            factor = re.sub(r"\d\.\d+(e-\d+)?", "...", f"{f.noun} {f.words} {f.formula} [{f.unit}]")
            by_factor.setdefault(factor, []).append(x.word)
        lines += [f"    {factor}: {', '.join(words)}" for factor, words in by_factor.items()]
    approved("targets.txt", "\n".join(lines) + "\n")


def test_a_slide_is_pushed_and_the_tip_of_a_rigid_link_is_where_its_joint_is() -> None:
    assert [target.unit for target in force_targets(ARMS["slide"])] == ["N", "N m", "N", "N"]
    stiff = PAPER.segments[0].model_copy(update={"modes": 0})
    one = PAPER.model_copy(update={"segments": (stiff,)})
    assert [target.name for target in force_targets(one)] == ["joint1"]


def test_the_direction_is_one_forwards_and_less_than_one_only_near_rest() -> None:
    factor = next(f for _, f in choices("joint2") if f.words == "times the sign of the speed")
    for along, m in zip(factor.along, motions(), strict=True):
        speed = m.v[:, 1]
        fast = np.abs(speed) > 0.2 * np.sqrt(np.mean(speed**2))
        assert along[fast] == pytest.approx(np.sign(speed[fast]), abs=1e-3)
        assert np.abs(along).max() <= 1.0


@pytest.mark.parametrize("name", ["joint1", "joint2", "tip1", "tip2", "z2", "theta1"])
def test_every_choice_is_a_formula_of_its_target(name: str) -> None:
    for x, factor in choices(name):
        word = x.word.format(**{c.name: c.name for c in x.constants})
        text = f"a*({word})*{factor.formula}" if factor.formula else f"a*({word})"
        free = tuple(own_parameter(*constant) for constant in x.constants)
        own = own_law(PAPER, name, text, (own_parameter("a", 1.0), *free), "own_1")
        assert name in own.story
        low, high = ends(x)
        assert low < high and all(low <= a.min() and a.max() <= high for a in x.along)


@pytest.mark.parametrize(
    ("name", "word"),
    [("joint1", "theta1"), ("joint1", "theta2"), ("joint1", "delta1"), ("joint2", "delta2"),
     ("tip1", "z1"), ("tip2", "z2")],
)  # fmt: skip
def test_a_rate_is_that_of_its_place(name: str, word: str) -> None:
    found = {x.word: x for x, factor in choices(name) if not factor.formula}
    place, rate = found[word], found[f"d{word}"]
    assert rate.unit == f"{place.unit}/s"
    for x, v, m in zip(place.along, rate.along, motions(), strict=True):
        way = scipy.integrate.cumulative_trapezoid(v, m.time, initial=0.0)
        assert x - x[0] == pytest.approx(way, abs=RATES * np.ptp(x))


def test_variables_are_those_of_the_motion() -> None:
    found = {x.word: x.along for x, factor in choices("joint1") if not factor.formula}
    for k, m in enumerate(motions()):
        assert np.array_equal(found["theta2"][k], m.q[:, 1])
        assert np.array_equal(found["u1"][k], m.torque[:, 0])
        assert found["t"][k] == pytest.approx(np.arange(len(m.time)) * 1e-3)
        assert found["t"][k][0] == 0.0


def test_a_column_that_is_named_as_an_input_is_a_variable() -> None:
    model = fitted()
    experiments = tuple(
        replace(e, recording=replace(r, channels={**r.channels, "input1": np.sin(r.time)}))
        for e, r in ((e, e.recording) for e in model.data.experiments)
    )
    heated = FittedModel(replace(model.data, experiments=experiments), model.refit, ())
    words = [x.word for x, _ in named("joint1").choices(heated, motions())]
    assert "input1" in words and "input1" not in [x.word for x, _ in choices("joint1")]


def test_what_is_added_to_a_reading_moves_that_channel_alone() -> None:
    model, name = fitted(), "z2"
    target = named(name)
    signals = [tuple(np.sin(9.0 * m.time) for m in motions())]
    ((change,),) = target.responses(model, signals)
    (e,), floors = model.data.experiments, model.data.floors
    k = [channel for channel, _ in e.channels].index(name)
    counted = e.counted[:, k]
    assert counted.any() and not np.delete(change, k, axis=1).any()
    assert change[counted, k] * floors[name] == pytest.approx(
        np.sin(9.0 * motions()[0].time)[counted], abs=1e-9
    )


def test_forwards_and_backwards_together_are_always() -> None:
    target = named("joint2")
    assert isinstance(target, JointTarget)
    sides = target.by_direction(fitted(), motions())
    assert [x.word for x, _, _ in sides] == ["theta2", "t"]
    for _, one, other in sides:
        for a, b in zip(one.along, other.along, strict=True):
            assert a + b == pytest.approx(1.0) and min(a.min(), b.min()) >= 0.0
