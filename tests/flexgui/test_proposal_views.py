"""Proposed laws in pictures and a table."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from flexgui.core.results import Outcome, Proposal
from flexgui.core.results.proposal import NO_LAW
from flexgui.export.report import report_html
from flexgui.views.layout import Figure, figure_json
from flexgui.views.proposal import MOST_SHOWN, carrier_shares, law_over_variable, laws_table
from tests.flexgui.findings import FOUND
from tests.sentences.proposals import PLACES, STIFFNESS, carrier, law, proposal, term

DRAWN = 1e-6
"""Relative: figures are drawn with single precision at the least."""


def shares_of(found: Proposal) -> Figure:
    figure = carrier_shares(found)
    assert figure is not None
    return figure


def traces(figure: Figure) -> dict[str, dict[str, Any]]:
    return {trace["name"]: trace for trace in figure["data"]}


def test_a_bar_per_variable_is_as_long_as_its_share() -> None:
    figure = shares_of(proposal(law()))
    (bars,) = figure["data"]
    assert bars["x"] == pytest.approx([97.0, 41.0, 0.0]), "nothing is explained by less than none"
    assert bars["text"] == ["97 %", "41 %", "0 %"]
    names = figure["layout"]["yaxis"]["ticktext"]
    assert names[0] == "the position of joint 2, at joint 2"
    assert names[1] == "the torque of drive 1, times the sign of the speed, at joint 1"
    assert figure["layout"]["xaxis"]["range"] == [0, 100]


def test_the_first_variables_alone_are_shown() -> None:
    many = Proposal(tuple(carrier(share=1.0 / k) for k in range(1, 20)))
    assert len(shares_of(many)["data"][0]["x"]) == MOST_SHOWN


def test_the_law_is_a_line_through_the_bars_of_what_the_recordings_show() -> None:
    one = law().terms[0]
    drawn = traces(law_over_variable(one.carrier, one))
    line, points = drawn["the law"], drawn["what the recordings show"]
    assert line["x"] == pytest.approx(one.places, rel=DRAWN)
    assert line["y"] == pytest.approx(one.values, rel=DRAWN)
    wide = points["error_y"]["array"]
    assert wide == pytest.approx(2.0 * 0.1)
    at = np.interp(points["x"], one.places, one.values)
    assert np.all(np.abs(at - points["y"]) <= wide)


def test_places_that_nothing_was_seen_of_are_not_drawn() -> None:
    """Nor does what a law says there decide which deviations are small."""
    (points,) = law_over_variable(carrier())["data"]
    assert points["name"] == "what the rest shows"
    assert points["x"] == pytest.approx(PLACES[:-1])
    assert np.isfinite(points["error_y"]["array"]).all()
    values = carrier().values.copy()
    values[-1] = 1e6
    (same,) = law_over_variable(carrier(values=values))["data"]
    assert same["y"] == pytest.approx(points["y"])


def test_small_values_are_drawn_in_small_units_with_law_and_bars_in_the_same() -> None:
    k = 1e-3 / STIFFNESS
    small = carrier(values=k * carrier().values, deviations=k * carrier().deviations)
    drawn = term(small)
    figure = law_over_variable(small, replace(drawn, values=k * drawn.values))
    assert figure["layout"]["yaxis"]["title"]["text"] == "missing [mN m]"
    line, dots = (traces(figure)[name] for name in ("the law", "what the recordings show"))
    at = np.interp(np.asarray(dots["x"]), np.asarray(line["x"]), np.asarray(line["y"]))
    assert at == pytest.approx(np.asarray(dots["y"]), abs=0.02 * float(np.max(line["y"])))
    assert dots["error_y"]["array"] == pytest.approx(1e3 * k * 2.0 * 0.1)


def test_without_carriers_or_laws_there_is_nothing_to_draw() -> None:
    assert carrier_shares(None) is None and carrier_shares(Proposal()) is None
    assert laws_table(None) is None and laws_table(proposal(reason=NO_LAW)) is None


def test_views_leave_what_they_draw_as_it_is() -> None:
    found = proposal(law())
    before = found.carriers[0].values.copy()
    one, other = (figure_json(law_over_variable(found.carriers[0], found.laws[0].terms[0]))
                  for _ in range(2))  # fmt: skip
    assert one == other and figure_json(shares_of(found)) == figure_json(shares_of(found))
    assert np.array_equal(found.carriers[0].values, before)


def test_a_report_without_a_law_says_on_what_the_rest_depends(glocal: Outcome) -> None:
    found = replace(FOUND, proposal=proposal(reason=NO_LAW))
    report = report_html(replace(glocal, diagnosis=found), "")
    assert "What the rest depends on" in report and "Proposed law" not in report
