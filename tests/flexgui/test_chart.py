"""A figure of lines as uPlot takes it: the same lines, in a look that only changes when it must."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.drives.torque import Torque
from flexgui.core.model import Model
from flexgui.core.simulate.posture import Posture, posture
from flexgui.core.simulate.response import frequency_response as gains_of
from flexgui.core.simulate.response import step_response
from flexgui.library.shipped import demo_scenario
from flexgui.session.scenario_edits import apply_edits, set_arm, set_value
from flexgui.session.state import LiveSettings
from flexgui.stages.arm.chart import NO_LINE, Chart, chart
from flexgui.stages.arm.live import live_model, prepare
from flexgui.views import colours
from flexgui.views.dynamics import DOTS, frequency_response, noisy_step, phase_response, step
from flexgui.views.layout import Figure, axis, dots, figure, line
from tests.flexgui.test_live_views import NAMES, at
from tests.helpers import ARMS

SINGLE = 1e-6
"""Relative: a figure's numbers are single precision."""


def noisy(here: Posture) -> Figure:
    response = step_response(here)
    draws = np.random.default_rng(3).standard_normal(response.values.shape)
    return noisy_step(response, 0.1 * draws)


def labelled(found: Chart, x: str, y: str) -> bool:
    return [a["label"] for a in found.look["axes"]] == [x, y]


@pytest.mark.parametrize("arm", NAMES)
def test_each_line_keeps_its_points_name_colour_and_axes(arm: str) -> None:
    given = step(step_response(at(arm)))
    found = chart(given)
    layout, series = given["layout"], found.look["series"]
    assert labelled(found, layout["xaxis"]["title"]["text"], layout["yaxis"]["title"]["text"])
    assert len(found.data) == len(series) == 1 + len(given["data"])
    for trace, column, one in zip(given["data"], found.data[1:], series[1:], strict=True):
        assert np.allclose(column, trace["y"], rtol=SINGLE)
        assert one["label"].endswith(trace["name"])
        assert one["stroke"] == trace["line"]["color"]
        assert bool(one["dash"]) == (trace["line"]["dash"] != "solid")
    marks = [(one["stroke"], one["label"][0]) for one in series[1:]]
    assert len(set(marks)) == len(marks), "lines of one colour differ in their name's mark"


def test_dots_keep_their_places_and_are_no_line() -> None:
    given = noisy(at("2-2"))
    found = chart(given)
    dotted = given["data"][0]
    shown = np.isfinite(found.data[1])
    assert np.allclose(found.data[0][shown], dotted["x"], rtol=SINGLE)
    assert np.allclose(found.data[1][shown], dotted["y"], rtol=SINGLE)
    one = found.look["series"][1]
    assert one["points"]["show"] and one["dash"] == NO_LINE
    assert one["stroke"] == colours.faded(colours.MEASURED, 0.6)


@pytest.mark.parametrize("arm", NAMES)
def test_every_output_has_its_noisy_dots_at_times_of_their_own(arm: str) -> None:
    here = at(arm)
    outputs = min(step_response(here).values.shape[1:])
    dotted = noisy(here)["data"][0]
    assert len(np.unique(dotted["x"])) == len(dotted["x"])
    assert DOTS * outputs <= len(dotted["x"]) < 2 * DOTS * outputs + outputs


def test_gains_far_below_the_largest_run_along_the_edge() -> None:
    given = frequency_response(gains_of(at("2-2")))
    found = chart(given)
    least = 10.0 ** given["layout"]["yaxis"]["range"][0]
    assert {scale["distr"] for scale in found.look["scales"].values()} == {3}
    assert min(column.min() for column in found.data[1:]) >= least * (1.0 - SINGLE)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
def test_what_no_axis_can_hold_is_a_gap(bad: float) -> None:
    x = np.array([0.0, 1.0, 2.0])
    trace = {**line(x, x, "a", "#000"), "y": np.array([1.0, bad, -3.0])}
    found = chart(figure([trace], axis("time [s]"), axis("y [m]"))).data[1]
    assert np.array_equal(found, [1.0, np.nan, -3.0], equal_nan=True)


def test_a_gap_is_no_point_of_a_logarithmic_axis() -> None:
    """There uPlot would draw a line to the lower end of the axis."""
    at_rest = np.array([0.0, 1.2])
    given = frequency_response(gains_of(posture(Model(ARMS["2-2"], Torque()), at_rest)))
    gaps = np.isnan([trace["y"] for trace in given["data"]]).any(axis=0)
    found = chart(given)
    assert gaps.any() and len(found.data[0]) == np.sum(~gaps)
    assert all(np.isfinite(column).all() for column in found.data)


def test_the_look_stays_while_only_numbers_change() -> None:
    """Another look makes the browser build the chart anew."""

    def shown(factor: float) -> Figure:
        x = np.linspace(0.0, 1.0, 5)
        drawn = [line(x, factor * x, "a", "#000"), dots(x[1:3], factor * x[1:3], "b", "#111")]
        return figure(drawn, axis("time [s]"), axis("y [m]"))

    assert chart(shown(1.0)).look == chart(shown(3.0)).look


@settings(max_examples=25)
@given(
    *[
        st.tuples(st.floats(*ends), st.floats(*ends))
        for ends in [(0.1, 1.5), (0.1, 20.0), (1.0, 400.0)]
    ]
)
def test_the_axes_of_every_arm_have_ends_that_stay_above_zero(
    lengths: tuple[float, float], masses: tuple[float, float], gains: tuple[float, float]
) -> None:
    """An end below the data's wanders further with each new length of the axis."""
    demo = demo_scenario()
    scenario = apply_edits(
        demo,
        set_arm(demo, "length", list(lengths)),
        set_arm(demo, "mass", list(masses)),
        set_value(("drive", "gains"), list(gains)),
    )
    view = live_model(prepare(scenario, None), LiveSettings())
    for drawn in (frequency_response(view.frequency), phase_response(view.frequency)):
        found = chart(drawn)
        ends = np.log10(found.data[0][[0, -1]])
        assert np.array_equal(ends, np.rint(ends)) and ends[0] < ends[1]
        assert np.all(np.diff(found.data[0]) >= 0.0)
        assert all(np.isfinite(column).all() for column in found.data)
    assert min(c.min() for c in chart(frequency_response(view.frequency)).data[1:]) > 0.0
