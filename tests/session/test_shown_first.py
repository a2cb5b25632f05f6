"""What is shown without being asked for: the worst output, changes from the start, refits only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.recording.recording import Recording
from flexgui.core.results import ChannelComparison, LadderStep, RecordingComparison
from flexgui.stages.compare.panel_plots import worst_output
from flexgui.stages.diagnose.model_versions import ModelFindings, refitted_only
from flexgui.views.preview import preview
from tests.session.test_candidates import ONE

TIME = np.linspace(0.0, 1.0, 200)


def compared(name: str, error: float, fitted: bool = True) -> ChannelComparison:
    measured = np.sin(9.0 * TIME)
    return ChannelComparison(
        channel=name, unit="m", time=TIME, measured=measured, model=measured - error,
        counted=np.ones(200, dtype=bool), fitted=fitted,
    )  # fmt: skip


def test_compare_opens_on_the_output_that_fails_most() -> None:
    both = (compared("z1", 1e-3), compared("z2", 2e-3), compared("y1", 1.0, fitted=False))
    shown = RecordingComparison("r", "estimate", "all", both)
    assert worst_output(shown, {}) == "z2"
    assert worst_output(shown, {"z1": 1e-6, "z2": 1e-3}) == "z1", "in multiples of its noise floor"
    floors = {"z1": 1e-3, "z2": 1e-3, "y1": 1e-2}
    assert worst_output(shown, floors) == "y1", "what is not fitted, too, where its noise is known"


def test_positions_that_hardly_move_are_drawn_as_a_change() -> None:
    swing = 1e-3 * np.sin(9.0 * TIME)
    channels = {"theta1": swing, "theta2": 0.8 + swing, "deflection1": swing, "z1": 0.5 + swing}
    figure = preview(Recording("r", TIME, channels))
    titles = {figure["layout"][k]["title"]["text"] for k in figure["layout"] if "yaxis" in k}
    assert any(t.startswith("Δθ₁, Δθ₂") for t in titles) and any("Δz₁" in t for t in titles)
    assert any(t.startswith("δ₁") for t in titles), "what is seen already stays as it is"
    moved = [t for t in figure["data"] if t["name"] == "joint 2"]
    assert np.asarray(moved[0]["y"])[0] == pytest.approx(0.0)
    wide = preview(Recording("r", TIME, {"theta1": TIME, "theta2": 0.5 + TIME}))
    assert wide["layout"]["yaxis"]["title"]["text"].startswith("θ₁")


def test_each_joint_stands_in_the_legend_once_with_its_own_dash() -> None:
    channels = {f"{stem}{k}": k * np.sin(TIME) for stem in ("theta", "u") for k in (1, 2)}
    data = preview(Recording("r", TIME, channels))["data"]
    assert [t["name"] for t in data if t["showlegend"]] == ["joint 1", "joint 2"]
    for name in ("joint 1", "joint 2"):
        assert (
            len({(t["line"]["color"], t["line"]["dash"]) for t in data if t["name"] == name}) == 1
        )
    assert len({t["line"]["dash"] for t in data}) == 2


def test_a_challenge_lists_what_refits_have_shown() -> None:
    tried = replace(ONE, effect="tried", refit_drop_percent=50.0)
    guessed = replace(ONE, effect="guessed", refit_drop_percent=None)
    found = ModelFindings(
        LadderStep(None, "as given", (), (), None, 9.0), ("a",), (("z1",),), (1e-3,),
        (np.zeros((3, 1)),), ranking=(guessed, tried),
    )  # fmt: skip
    shown = refitted_only(found)
    assert [r.effect for r in shown.ranking] == ["tried"]
