"""The figures that follow a slider: pure, with units, quick to send."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable

import numpy as np
import plotly.graph_objects as go
import pytest

from flexgui.core.drives.torque import Torque
from flexgui.core.model import Model
from flexgui.core.simulate.posture import Posture, posture, vibration_modes
from flexgui.core.simulate.response import frequency_response as gains_of
from flexgui.core.simulate.response import step_response
from flexgui.sentences.written import channel_symbol
from flexgui.views.dynamics import (
    NEGLIGIBLE,
    frequency_response,
    mode_table,
    phase_response,
    poles,
    step,
    window,
)
from flexgui.views.layout import PANEL_HEIGHT, Figure, figure_json, short
from tests.helpers import ARMS, looped

LARGEST_MESSAGE = 60_000
"""Characters of a figure; four of them follow a slider ten times a second."""

SINGLE = 1e-6
"""Relative: numbers travel in single precision."""

PHASE = 1e-4
"""Relative: hundreds of degrees in single precision, in radians."""

NAMES = ["one mode", "2-2", "slide", "ground", "rigid pair"]


def at(name: str) -> Posture:
    arm = ARMS[name]
    return posture(looped(arm, 20.0), np.resize([0.2, 1.2], arm.joints))


FIGURES: dict[str, Callable[[Posture], Figure]] = {
    "poles": lambda h: poles(h.poles, vibration_modes(h), vibration_modes(h, clamped=True)),
    "step": lambda h: step(step_response(h)),
    "frequency_response": lambda h: frequency_response(gains_of(h)),
    "phase_response": lambda h: phase_response(gains_of(h)),
}


@pytest.mark.parametrize("arm", NAMES)
@pytest.mark.parametrize("name", FIGURES)
def test_axes_carry_units_and_panels_fit(name: str, arm: str) -> None:
    figure = FIGURES[name](at(arm))
    layout = figure["layout"]
    for key in ("xaxis", "yaxis"):
        assert re.search(r"\[.+\]$", layout[key]["title"]["text"])
        assert np.all(np.isfinite(layout[key].get("range", [0.0, 1.0])))
    assert layout["height"] == PANEL_HEIGHT
    assert layout["meta"]["caption"].endswith(".")
    assert len(figure_json(figure)) < LARGEST_MESSAGE
    assert figure_json(figure) == figure_json(FIGURES[name](at(arm)))


@pytest.mark.parametrize("name", FIGURES)
def test_figures_hold_what_plotly_knows(name: str) -> None:
    """They are built without Plotly's checks, so the checks are made here."""
    go.Figure(FIGURES[name](at("2-2")))


def test_curves_have_a_gap_at_a_pole_without_damping_and_go_on_beyond_it() -> None:
    response = gains_of(posture(Model(ARMS["2-2"], Torque()), np.array([0.0, 1.0])))
    gaps = np.isnan(response.gain).all(axis=(1, 2))
    assert 0 < gaps.sum() < 0.1 * len(gaps)
    for draw in (frequency_response, phase_response):
        figure = draw(response)
        go.Figure(figure)
        assert len(figure["data"]) == 4
        for trace in figure["data"]:
            assert np.array_equal(np.isnan(trace["y"]), gaps)
        assert np.all(np.isfinite(frequency_response(response)["layout"]["yaxis"]["range"]))


def test_far_poles_are_told_and_not_drawn() -> None:
    here = at("2-2")
    figure = FIGURES["poles"](here)
    left, _, far = window(here.poles)
    assert far.size
    assert figure["layout"]["annotations"][0]["text"].startswith("◂ also at −")
    drawn = next(t for t in figure["data"] if t.get("name") == "drive closed")
    assert min(drawn["x"]) >= left


def test_swinging_poles_and_names_of_lines_of_equal_damping_are_inside_the_plot() -> None:
    for name in NAMES:
        here = at(name)
        edge, top, _ = window(here.poles)
        modes = vibration_modes(here)
        assert all(edge < mode.pole.real and mode.pole.imag < top for mode in modes)
        figure = FIGURES["poles"](at(name))
        rays, named = figure["data"][:2]
        left, top = figure["layout"]["xaxis"]["range"][0], figure["layout"]["yaxis"]["range"][1]
        assert len(named["text"]) == 3
        assert list(named["x"]) == rays["x"][::3]
        assert min(named["x"]) > left
        assert max(named["y"]) < top
        ratios = -named["x"] / np.hypot(named["x"], named["y"])
        assert named["text"] == [f"ζ = {ratio:.1g}" for ratio in ratios]


def test_poles_of_an_arm_without_a_spring_can_be_drawn() -> None:
    arm = ARMS["rigid pair"]
    here = posture(Model(arm, Torque()), np.array([0.0, 1.0]))
    assert window(here.poles)[:2] == (-1.0, 1.0)
    assert figure_json(poles(here.poles))
    assert figure_json(frequency_response(gains_of(here)))


def test_each_pair_of_reference_and_output_has_its_line() -> None:
    names = [trace["name"] for trace in FIGURES["step"](at("2-2"))["data"]]
    pairs = [(r, y) for y in ("ydot1", "ydot2") for r in ("dtheta1", "dtheta2")]
    assert names == [f"{channel_symbol(r)}* → {channel_symbol(y)}" for r, y in pairs]
    names = [trace["name"] for trace in FIGURES["step"](at("ground"))["data"]]
    absent = f"{channel_symbol('dtheta1')}* → {channel_symbol('deflection2')}"
    assert names and absent not in names, "segments on the ground do not feel each other"


def test_modes_are_told_with_frequency_and_damping() -> None:
    rows = mode_table(vibration_modes(at("2-2"), clamped=True)).rows
    assert len(rows) == 4 and all(row.cells[2] == "0" for row in rows)


def test_vectors_travel_as_plotly_itself_sends_them() -> None:
    """Plotly's own writer is the oracle: the same layout, and vectors that decode to the same."""
    figure = FIGURES["step"](at("2-2"))
    ours = json.loads(figure_json(figure))
    theirs = json.loads(go.Figure(figure).to_json())
    assert ours["layout"].keys() - theirs["layout"].keys() <= {"template"}
    for mine, other in zip(ours["data"], theirs["data"], strict=True):
        np.testing.assert_allclose(decoded(mine["y"]), decoded(other["y"]), rtol=SINGLE)


def test_what_is_not_a_number_is_a_gap() -> None:
    assert np.isnan(decoded(json.loads(figure_json(short(np.array([1.0, np.inf])))))[1])
    assert figure_json([1.0, float("nan"), np.float64(2.5)]) == "[1.0,null,2.5]"


def decoded(vector: dict[str, str]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(vector["bdata"]), np.dtype(vector["dtype"]))


@pytest.mark.parametrize("arm", NAMES)
def test_magnitude_and_phase_give_the_gain_again(arm: str) -> None:
    found = gains_of(at(arm))
    strong, late = (view(found)["data"] for view in (frequency_response, phase_response))
    assert [trace["name"] for trace in late] == [trace["name"] for trace in strong]
    columns = found.gain.reshape(len(found.frequency), -1).T
    largest = np.abs(columns).max()
    drawn = [c for c in columns if np.abs(c).max() > NEGLIGIBLE * largest]
    for gain, size, turned in zip(drawn, strong, late, strict=True):
        again = size["y"] * np.exp(1j * np.deg2rad(turned["y"].astype(float)))
        assert again == pytest.approx(gain, rel=PHASE, abs=PHASE * np.abs(gain).max())
