"""The one picture of a diagnosis, and the ladder above it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from flexgui.core.results import LadderStep, MissingTorque
from flexgui.session.state import Cursor
from flexgui.stages.diagnose.panel import DiagnosePanel
from flexgui.stages.diagnose.panel_candidate_figure import CandidateFigure
from flexgui.stages.diagnose.plots import (
    cloud_caption,
    residual_figure,
    rms,
    torque_cloud,
    worst_channel,
)
from flexgui.views.ladder import BAND, ladder
from flexgui.views.over_speed import OverSpeed

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


@pytest.mark.parametrize(("recording", "time"), [("th1", 1.25), ("a long one", None)])
def test_the_cursor_of_another_recording_does_not_stretch_the_axis(
    recording: str, time: float | None
) -> None:
    moment, seen = CandidateFigure.__new__(CandidateFigure), list[float | None]()
    session = SimpleNamespace(playback=SimpleNamespace(cursor=Cursor(recording, 1.25)))
    moment.context = cast(Any, SimpleNamespace(session=session))
    moment._residual = cast(Any, SimpleNamespace(move_cursor=seen.append))
    moment._over_time = "th1"
    moment.move_cursor()
    assert seen == [time]


def test_a_cursor_that_goes_to_another_recording_takes_the_residual_along() -> None:
    panel, drawn = DiagnosePanel.__new__(DiagnosePanel), list[str]()
    version = SimpleNamespace(found=SimpleNamespace(recordings=("th1", "th2")))
    session = SimpleNamespace(
        diagnosis=SimpleNamespace(newest=version), playback=SimpleNamespace(cursor=Cursor("th1"))
    )
    panel.context = cast(Any, SimpleNamespace(session=session))
    panel._residual = panel._candidate_figure = cast(
        Any, SimpleNamespace(move_cursor=lambda *_: None, refresh=lambda: None)
    )
    panel._residual_of = "th1"
    cast(Any, panel)._show_residual = lambda: drawn.append(session.playback.cursor.recording)
    for name in ("th1", "th2", "only validated"):
        session.playback.cursor = Cursor(name)
        panel.move_cursor()
    assert drawn == ["th2"]
