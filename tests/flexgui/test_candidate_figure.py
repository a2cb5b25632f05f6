"""The one picture of a diagnosis, the law of an effect in it, and the ladder above it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.effects import catalogue, effect, with_included
from flexgui.core.results import LadderStep, MissingTorque, RankedEffect
from flexgui.session.state import Cursor
from flexgui.stages.diagnose.panel import DiagnosePanel
from flexgui.stages.diagnose.panel_candidate_figure import CandidateFigure
from flexgui.stages.diagnose.plots import (
    cloud_caption,
    glimpse,
    picture,
    residual_figure,
    rms,
    torque_cloud,
    worst_channel,
)
from flexgui.stages.diagnose.task import MOST_ROWS, thinned
from flexgui.views.ladder import BAND, ladder
from flexgui.views.over_speed import OverSpeed, over_speed
from tests.effects.helpers import KINDS
from tests.flexgui.findings import FOUND, step
from tests.helpers import PAPER, looped

SPEED = np.sin(np.linspace(0.0, 20.0, 200))


def torque(joint: int, size: float) -> MissingTorque:
    """Of dry friction."""
    time = np.linspace(0.0, 1.0, 200)
    counted = np.ones(200, dtype=bool)
    return MissingTorque(joint, "N m", time, SPEED, "rad/s", size * np.sign(SPEED), SPEED, counted)


def law(joint: int, size: float) -> OverSpeed:
    speed = np.linspace(-1.0, 1.0, 5)
    return OverSpeed(joint, speed, -size * np.sign(speed), line=True)


def test_what_an_effect_has_explained_is_gone_on_the_same_axes() -> None:
    first = (torque(1, 2.0), torque(2, 0.5))
    before = torque_cloud(first, (law(1, 2.0), law(2, 0.5)), "Coulomb friction", first)
    after = torque_cloud((torque(1, 0.01), torque(2, 0.01)), (), "", first)
    for axis in ("yaxis", "yaxis2"):
        assert before["layout"][axis]["range"] == after["layout"][axis]["range"]
    assert max(after["layout"]["yaxis"]["range"]) > 2.0
    assert before["layout"]["meta"]["morph"] and after["layout"]["meta"]["morph"]
    # The law lies on the dots: the drive delivers what the effect takes.
    line = next(t for t in before["data"] if t["name"] == "Coulomb friction")
    assert np.asarray(line["y"]).max() == pytest.approx(2.0)
    domains = [before["layout"][axis]["domain"] for axis in ("xaxis", "xaxis2")]
    assert domains[0][1] < domains[1][0]


def test_the_dots_of_before_and_after_belong_to_the_same_samples() -> None:
    """Or the page could not move each to its new place."""
    first, left = (torque(1, 2.0),), (torque(1, 0.01),)
    a, b = torque_cloud(first, (), "", first), torque_cloud(left, (), "", first)
    for was, now in zip(a["data"], b["data"], strict=True):
        assert was["name"] == now["name"]
        assert np.array_equal(was["x"], now["x"])


def test_the_figure_says_what_it_was_and_what_is_left() -> None:
    assert cloud_caption((torque(1, 2.0),), (torque(1, 2.0),)) == "joint 1: 2 N m"
    assert cloud_caption((torque(1, 0.1),), (torque(1, 2.0),)) == "joint 1: 2 → 0.1 N m"
    masked = replace(torque(1, 2.0), counted=np.zeros(200, dtype=bool))
    assert rms(masked) == 0.0


def test_the_residual_keeps_the_axis_of_the_first_look() -> None:
    time = np.arange(100)
    strong, weak = 20.0 * np.sin(time), 0.9 * np.cos(time)
    before = residual_figure("z1", 0.01, strong, strong, "Coulomb friction", strong)
    after = residual_figure("z1", 0.01, weak, None, "", strong)
    assert before["layout"]["yaxis"]["range"] == after["layout"]["yaxis"]["range"]
    assert before["layout"]["yaxis"]["range"][1] > 20.0
    assert [t["name"] for t in before["data"]] == ["residual", "Coulomb friction"]
    assert worst_channel(np.stack([weak, strong], axis=1)) == 1


@given(rows=st.integers(2, 5 * MOST_ROWS), every=st.integers(1, 400), first=st.integers(0, 400))
def test_a_slow_camera_is_drawn_at_its_own_samples(rows: int, every: int, first: int) -> None:
    """A residual is zero where nothing is compared; drawn it looked like a comb."""
    counted = np.zeros((rows, 1), dtype=bool)
    counted[first % rows :: every] = True
    block = np.where(counted, 9.0, 0.0)
    effect = RankedEffect(
        "tip_payload", "Tip payload", 9.0, 0.0, 50.0, 50.0, 9.0, predicted=(block,)
    )
    (seen,) = thinned((effect,), [counted])[0].predicted
    assert 0.5 * MOST_ROWS < len(seen) <= MOST_ROWS or len(seen) == rows
    assert np.isfinite(seen).sum() >= min(counted.sum(), len(seen)) / 2
    assert worst_channel(seen) == 0
    lines = residual_figure("z1", 0.01, seen[:, 0], seen[:, 0], "", seen[:, 0])["data"]
    for line in lines:
        assert set(line["y"]) == {9.0}, "one line"
    shown = glimpse(("th1",), (("z1",),), (0.01,), (seen,), (seen,))
    assert shown is not None
    assert str(picture(shown)).count("M") == 3, "each curve is one line"


def test_the_ladder_falls_into_the_band_with_the_factor_beside_it() -> None:
    steps = [
        LadderStep(None, "As given", (), (), None, 20.0**2),
        LadderStep("coulomb_friction", "Coulomb friction", (), (), None, 0.8**2),
        LadderStep("tip_payload", "Tip payload", (), (), None, 0.79**2),
    ]
    figure = ladder(steps)
    assert figure is not None
    factors = figure["layout"]["yaxis2"]
    assert factors["side"] == "right"
    assert factors["ticktext"] == [" ", "<b>÷ 25</b>", " "], "none where nothing falls"
    band = next(s for s in figure["layout"]["shapes"] if s["type"] == "rect")
    assert (band["x0"], band["x1"]) == (BAND, 1.0)


def test_what_is_expected_of_an_effect_that_is_being_fitted_is_a_pale_row_without_a_factor() -> (
    None
):
    given = LadderStep(None, "As given", (), (), None, 20.0**2)
    figure = ladder([given], expected=("Coulomb friction", 1.0))
    assert figure is not None
    solid, pale = figure["data"][0]["marker"]["color"]
    assert pale != solid and figure["data"][0]["text"] == ["20 ×", "1.0 ×"]
    assert figure["layout"]["yaxis"]["ticktext"][1].endswith("expected")
    assert "÷" not in "".join(figure["layout"]["yaxis2"]["ticktext"])


def told(**parts: Any) -> Any:
    return SimpleNamespace(**parts)


def test_a_cursor_in_another_recording_takes_the_residual_along_and_stretches_no_axis() -> None:
    playback, seen, drawn = told(cursor=Cursor("th1")), list[float | None](), list[str]()
    found = told(recordings=("th1", "th2"))
    session = told(playback=playback, diagnosis=told(newest=told(found=found)))
    moment = CandidateFigure.__new__(CandidateFigure)
    panel = cast(Any, DiagnosePanel.__new__(DiagnosePanel))
    moment.context = panel.context = told(session=session)
    moment._over_time = panel._residual_of = "th1"
    moment._residual = cast(Any, told(move_cursor=seen.append))
    panel._residual = told(move_cursor=lambda _: None)
    panel._candidate_figure = told(move_cursor=moment.move_cursor, refresh=lambda: None)
    panel._show_residual = lambda: drawn.append(playback.cursor.recording)
    for name in ("th1", "th2", "only validated"):
        playback.cursor = Cursor(name, 1.25)
        panel.move_cursor()
    assert (drawn, seen) == (["th2"], [0.0, None, None])


VALUES = {"fc1": 1.2, "fc2": 0.4, "fv1": 3.0, "fv2": 2.0, "fb1": 0.5, "fb2": 0.1}
TIME = np.linspace(0.0, 1.0, 101)
PLACE = np.column_stack([0.1 * np.sin(6 * TIME), 0.2 * np.cos(5 * TIME)])
SPEEDS = np.gradient(PLACE, TIME, axis=0)


def of(kind: str, **values: float) -> tuple[OverSpeed, ...]:
    base = looped(PAPER)
    model = base.with_effects([effect(kind)], {**VALUES, **values})
    have = with_included([effect(kind)])
    return over_speed(have, model.arm, model.numbers().p, model.effect_values, PLACE, SPEEDS)


def test_coulomb_friction_is_a_step_against_the_motion() -> None:
    first, second = of("coulomb_friction")
    assert (first.joint, second.joint) == (1, 2) and first.line
    np.testing.assert_allclose(first.torque, -1.2 * np.sign(first.speed))
    np.testing.assert_allclose(second.torque, -0.4 * np.sign(second.speed))
    assert first.speed.min() == SPEEDS[:, 0].min() and first.speed.max() == SPEEDS[:, 0].max()


def test_viscous_friction_is_a_slope() -> None:
    first, _ = of("viscous_friction")
    np.testing.assert_allclose(first.torque, -3.0 * first.speed)


def test_an_effect_is_drawn_with_what_it_includes() -> None:
    first, _ = of("stribeck_friction", vs1=0.1, vs2=0.1)
    v = first.speed
    expected = -(1.2 + 0.5 * np.exp(-((v / 0.1) ** 2))) * np.sign(v)
    np.testing.assert_allclose(first.torque, expected)


def test_what_depends_on_the_place_is_drawn_along_the_motion() -> None:
    values = {"ra1": 0.3, "rb1": 0.0, "nr1": 20.0, "ra2": 0.0, "rb2": 0.1, "nr2": 20.0}
    first, _ = of("torque_ripple", **values)
    assert not first.line
    np.testing.assert_allclose(first.speed, SPEEDS[:, 0])
    np.testing.assert_allclose(first.torque, 0.3 * np.cos(20.0 * PLACE[:, 0]))


@pytest.mark.parametrize("kind", KINDS)
def test_every_effect_has_a_law_for_each_joint_or_none(kind: str) -> None:
    found = of(kind)
    assert len(found) in (0, PAPER.joints)
    assert all(np.isfinite(one.torque).all() for one in found)
    if catalogue()[kind].acts_at in ("tip", "camera", "segments", "base"):
        assert not found, "no law at a joint"


def ticks(error: float) -> list[str]:
    """Of a ladder that begins at so many floors."""
    figure = ladder([replace(FOUND.steps[0], cost_per_sample=error**2, errors=())])
    assert figure is not None
    return list(figure["layout"]["xaxis"]["ticktext"])


@pytest.mark.parametrize("error", [0.5, 1.0, 9.99, 10.0, 299.0, 1e5])
def test_the_axis_names_the_floor_and_numbers_that_are_read_at_a_glance(error: float) -> None:
    assert ticks(error)[0] == "1"
    assert ticks(16.0) == ["1", "2", "5", "10", "20", "50"]
    assert ticks(2000.0) == ["1", "10", "100", "1000", "10000"]


def test_a_row_is_as_high_however_many_there_are_and_its_name_stands_level() -> None:
    kinds = ("Coulomb friction", "Structural damping", "Delay of one sensor against the others")
    steps = (FOUND.steps[0], *(step(title, title, 4.0, 4.0) for title in kinds))
    heights = [figure["layout"]["height"] for k in range(1, 5) if (figure := ladder(steps[:k]))]
    assert np.ptp(np.diff(heights)) == 0
    figure = ladder(steps)
    assert figure is not None
    assert figure["layout"]["yaxis"]["ticktext"] == [
        "as given", "+ Coulomb friction", "+ Structural damping",
        "+ Delay of one<br>sensor against the<br>others",
    ]  # fmt: skip
