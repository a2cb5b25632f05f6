"""What the page shows of made-up results: candidates, where the model fails, figures and tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from markupsafe import Markup

from flexgui.core.recording.recording import Recording
from flexgui.core.results import (
    MISSING,
    NOTHING,
    ChannelComparison,
    ChannelError,
    Diagnosis,
    Equation,
    Estimate,
    Fit,
    Generation,
    Identifiability,
    LadderStep,
    RankedEffect,
    RecordingComparison,
    WorstCell,
)
from flexgui.library.shipped import demo_scenario
from flexgui.stages.compare.panel_plots import WORDS as COMPARE_WORDS
from flexgui.stages.compare.panel_plots import worst_output
from flexgui.stages.compare.state import where_it_fails
from flexgui.stages.diagnose.effects import own_place, own_ranked, ranked_with_own
from flexgui.stages.diagnose.fitted_models import FittedModel, errors_of
from flexgui.stages.diagnose.model_versions import (
    ModelFindings,
    ModelVersion,
    ladder_steps,
    restated,
)
from flexgui.stages.diagnose.panel_candidates import WORDS, may_explain
from flexgui.stages.export.panel import WORDS as EXPORT_WORDS
from flexgui.stages.export.panel import Choice, Offer
from flexgui.views.convergence import (
    LIVE_POINTS,
    Searched,
    live_convergence,
    live_descent,
    live_parameters,
    live_plane,
)
from flexgui.views.error_map import error_text
from flexgui.views.ladder import ladder
from flexgui.views.parameter_tables import GLOCAL, MEAN, SNR_20, SNR_NONE, paper_table
from flexgui.views.preview import (
    ROWS,
    as_in_file,
    constant_columns,
    constants,
    groups,
    preview,
)
from flexgui.views.table import Column, Row, Table, html_equations, html_table
from tests.approved import approved

ONE = RankedEffect("tip_payload", "Tip payload", 50.0, 1e-9, 70.0, 46.0, 900.0)


def shown(*ranked: RankedEffect, rest: tuple[RankedEffect, ...] = (), over: bool = False) -> str:
    rows = [(one, "", "") for one in ranked]
    return str(WORDS.candidates(rows, rest, over, {}, True, ""))


def test_the_list_says_what_was_refitted_and_folds_what_explains_next_to_nothing() -> None:
    """A refitted share stands in bold, none is called all of the error, and a button tells those
    who read with the ears what it adds."""
    nearly, half, estimated, little = (
        replace(ONE, effect=title, title=title, refit_drop_percent=share)
        for title, share in (
            ("Nearly all", 99.97), ("Half", 46.0), ("Not refitted", None), ("Little", 0.3)
        )
    )  # fmt: skip
    less = replace(estimated, title="Less before refitting", expected_drop_percent=0.4)
    listed = shown(nearly, half, estimated, rest=(little, less))
    none = shown(rest=(little,), over=True)
    approved("candidates.html", f"{listed}\n{none}".replace("><", ">\n<"))


def test_exports_are_three_choices_of_which_the_report_invites() -> None:
    offers = (Offer("Report", "One page.", print), Offer("Scenario", "To run.", print, False))
    choices = (Choice("First", "", "M0 0h1", offers), Choice("Second", "", "M0 0h1", offers))
    before, after = (str(EXPORT_WORDS.files(choices, known, True)) for known in (False, True))
    assert before.count(" disabled") == 2 and " disabled" not in after
    assert after.count("<svg") == 2 and after.count("class='main'") == 1
    assert "class='main'" not in before and before.count("<button") == 4


def listed(kind: str, refitted: float | None) -> RankedEffect:
    return RankedEffect(kind, kind, 9.0, 1e-9, 50.0, refitted, None)


def version(rms: float, *names: str, added: str | None = None) -> ModelVersion:
    step = LadderStep(
        None, "", tuple(Estimate(n, 1.0, 0.1, "", True) for n in names),
        (ChannelError("z1", "m", rms, 1.0),), None, rms**2,
    )  # fmt: skip
    found = ModelFindings(step, ("th1",), (("z1",),), (0.1,), (np.full((5, 1), rms),))
    return ModelVersion(demo_scenario(), "Own effect 1" if added else "", added, found)


BEFORE = version(10.0, "EI")
RANKING = (listed("a", 99.0), listed("b", 60.0), listed("c", None))


def with_list(ranking: tuple[RankedEffect, ...]) -> ModelVersion:
    assert BEFORE.found is not None
    return replace(BEFORE, found=replace(BEFORE.found, ranking=ranking))


def test_it_stands_between_what_explains_more_and_less() -> None:
    before, after = with_list(RANKING), version(5.0, "EI", "k", added="own_1")
    own = own_ranked(before, after)
    assert own is not None and own.refit_drop_percent == pytest.approx(100.0 * 75.0 / 99.0)
    assert [e.name for e in own.parameters] == ["k"]
    assert np.allclose(own.predicted[0], 5.0), "what was there less what is left"
    whole = ranked_with_own(before, after)
    assert [r.effect for r in whole.ranking] == ["a", "own_1", "b", "c"]
    assert [r.effect for r in ranked_with_own(whole, after).ranking] == ["a", "own_1", "b", "c"]
    assert own_place(before, after) == (
        "Your formula is number 2 of 4: it explains 75.8 % of the error above the noise floor; the "
        "best listed one, a, 99.0 %."
    )


def test_parameters_cost_something() -> None:
    names = ("k1", "k2", "k3", "k4")
    after = version(float(np.sqrt(100.0 - 0.61 * 99.0)), "EI", *names, added="own_1")
    whole = ranked_with_own(with_list(RANKING), after)
    assert [r.effect for r in whole.ranking] == ["a", "b", "own_1", "c"]


def test_without_a_list_there_is_no_place() -> None:
    after = version(5.0, "EI", "k", added="own_1")
    assert own_ranked(BEFORE, after) is None and own_place(BEFORE, after) == ""
    assert ranked_with_own(BEFORE, after) is BEFORE


def test_the_error_over_the_noise_floor_is_one_figure_in_verdict_ladder_and_list() -> None:
    found = tuple(version(rms, "EI", added=added) for rms, added in ((34.2, None), (8.5, "own_1")))
    drawn = ladder(ladder_steps(found))
    assert drawn is not None
    assert drawn["data"][0]["text"] == ["34 ×", "8.5 ×"]
    listed = FittedModel(found, 1, 0.0)
    assert errors_of(listed, found[-1]).fitted == pytest.approx(8.5)
    card = str(WORDS.verdict(None, found[-1].error, "", "", {}, "", False, True))
    assert "overall error\n8.5&nbsp;×&nbsp;noise floor: rms over all outputs" in card


@pytest.mark.parametrize(("floor", "said"), [(1.0, ""), (1.001, ""), (1.03, "was 6.4 times the")])
def test_a_first_row_that_reads_differently_after_a_step_is_explained(
    floor: float, said: str
) -> None:
    first, last = version(6.4, "EI"), version(1.0, "EI", added="own_1")
    assert last.found is not None
    errors = (ChannelError("z1", "m", floor, floor),)
    step = replace(last.found.step, errors=errors)
    words = restated((first, replace(last, found=replace(last.found, step=step))))
    assert said in words and bool(words) == bool(said)


N, DT = 1200, 1e-3
TIME = DT * np.arange(N)


def seen(name: str, late: float, floors: dict[str, float]) -> RecordingComparison:
    """Errors at the floor, and from 0.6 s on `late` times as large."""
    rng = np.random.default_rng(len(name))
    size = np.where(TIME < 0.6, 1.0, late)
    channels = [
        ChannelComparison(
            channel, "rad", 5.0 + TIME, model + floor * size * rng.standard_normal(N), model,
            np.ones(N, dtype=bool),
        )
        for channel, floor in floors.items()
        for model in [np.sin(6.0 * TIME)]
    ]  # fmt: skip
    return RecordingComparison(name, "estimate", "all", tuple(channels))


FLOORS = {"theta1": 1e-4, "z1": 2e-4, "z2": 2e-4}


def test_the_board_is_dark_where_the_error_is_large() -> None:
    found = where_it_fails((seen("a", 1.0, FLOORS), seen("bb", 30.0, FLOORS)), FLOORS)
    assert found.board is not None and found.board.recordings == ("a", "bb")
    assert np.all(found.board.ratio[0] < 1.3)
    assert np.all(found.board.ratio[1, 7:] > 20.0) and np.all(found.board.ratio[1, :5] < 1.3)


def test_the_error_at_a_moment_is_told_part_by_part() -> None:
    found = where_it_fails((seen("a", 20.0, FLOORS),), FLOORS).now["a"]
    early, late = found.at(0.2), found.at(1.0)
    assert set(early) == {"theta1", "camera"}
    assert all(value == pytest.approx(1.0, rel=0.3) for value in early.values())
    assert all(value == pytest.approx(20.0, rel=0.3) for value in late.values())
    assert found.worst > 15.0
    assert (
        error_text({"theta1": 1.5, "camera": 20.0})
        == "error at this moment, in noise floors of each output: θ₁ 1.5, camera 20"
    )


def test_an_exact_sensor_has_a_floor_all_the_same() -> None:
    exact = seen("a", 1.0, {"theta1": 1e-12})
    assert where_it_fails((exact,), None).floors["theta1"] > 1e-4, "a thousandth of its motion"


def test_only_what_is_twice_its_noise_stands_out() -> None:
    cells = [
        WorstCell("a < b", "theta2", "rad", "frequency", "Hz", 0.0, 3.9, 1e-3, ratio)
        for ratio in (1.9, 28.0)
    ]
    assert "Nothing stands out." in COMPARE_WORDS.worst(cells[:1], None)
    table = COMPARE_WORDS.worst(cells[1:], cells[1])
    assert "a &lt; b" in table and "0 to 3.9 Hz" in table and "aria-current" in table
    assert "Nothing stands out" not in table and "theta2" not in table


@pytest.mark.parametrize(
    ("error", "verdict", "invites"),
    [(9.7, None, True), (1.0, None, False), (9.7, MISSING, True), (0.99, NOTHING, False)],
)
def test_adding_invites_only_where_something_is_to_be_explained(
    error: float, verdict: str | None, invites: bool
) -> None:
    step = LadderStep(None, "As given", (), (), None, error**2)
    told = None if verdict is None else Diagnosis(verdict, None, (), (step,), {})
    assert may_explain(ModelFindings(step, (), (), (), (), diagnosis=told)) is invites


SECOND = np.linspace(0.0, 1.0, 200)


def compared(name: str, error: float, fitted: bool = True) -> ChannelComparison:
    measured = np.sin(9.0 * SECOND)
    return ChannelComparison(
        channel=name, unit="m", time=SECOND, measured=measured, model=measured - error,
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
    swing = 1e-3 * np.sin(9.0 * SECOND)
    channels = {"theta1": swing, "theta2": 0.8 + swing, "deflection1": swing, "z1": 0.5 + swing}
    figure = preview(Recording("r", SECOND, channels))
    titles = {figure["layout"][k]["title"]["text"] for k in figure["layout"] if "yaxis" in k}
    assert any(t.startswith("Δθ₁, Δθ₂") for t in titles) and any("Δz₁" in t for t in titles)
    assert any(t.startswith("δ₁") for t in titles), "what is seen already stays as it is"
    moved = [t for t in figure["data"] if t["name"] == "joint 2"]
    assert np.asarray(moved[0]["y"])[0] == pytest.approx(0.0)
    wide = preview(Recording("r", SECOND, {"theta1": SECOND, "theta2": 0.5 + SECOND}))
    assert wide["layout"]["yaxis"]["title"]["text"].startswith("θ₁")
    assert "[rad]" in wide["layout"]["yaxis"]["title"]["text"]
    slide = preview(Recording("r", SECOND, {"theta1": SECOND}), [True])
    assert "[m]" in slide["layout"]["yaxis"]["title"]["text"]


def test_each_joint_stands_in_the_legend_once_with_its_own_dash() -> None:
    channels = {f"{stem}{k}": k * np.sin(SECOND) for stem in ("theta", "u") for k in (1, 2)}
    data = preview(Recording("r", SECOND, channels))["data"]
    assert [t["name"] for t in data if t["showlegend"]] == ["joint 1", "joint 2"]
    looks = {(t["name"], t["line"]["color"], t["line"]["dash"]) for t in data}
    assert len(looks) == 2 == len({dash for _, _, dash in looks})


SEARCHED = (
    Searched("epsilon", r"\varepsilon", "Pa", 0.8e9, 1.2e9),
    Searched("d", "d", "m", 0.04, 0.06),
)
LAST_DIGIT = 1e-4
"""GPa: the paper prints four digits of ε, and cuts one of its means instead of rounding it."""


def history(count: int = 5) -> dict[str, tuple[Generation, ...]]:
    rng = np.random.default_rng(1)
    best = np.array([1.1e9, 0.0488])
    members = np.column_stack([rng.uniform(0.8e9, 1.2e9, 9), rng.uniform(0.04, 0.06, 9)])
    told = [Generation(k, 1.0 / (k + 1), 2.0, 3.0, best, members) for k in range(count)]
    return {"all recordings": tuple(told)}


def fit(label: str, eps: float) -> Fit:
    estimates = (
        Estimate("epsilon", eps, np.nan, "Pa", False),
        Estimate("d", 0.05, np.nan, "m", False),
    )
    derived = (Estimate("EI", 520.0, 0.5, "N m²", True),)
    known = Identifiability(("epsilon", "d"), 1, np.ones(2), np.zeros((1, 2)))
    return Fit(label, (label,), estimates, np.eye(2), 1.0, 10, (), known, 0.0, derived=derived)


def test_the_valley_goes_through_the_best_member() -> None:
    figure = live_plane(history(), SEARCHED)
    assert figure is not None
    valley = next(t for t in figure["data"] if "valley" in t["name"])
    eps, d = np.array(valley["x"]) * 1e9, np.array(valley["y"]) * 1e-3
    assert eps * d**4 == pytest.approx(1.1e9 * 0.0488**4, rel=1e-4)
    assert live_plane(history(), SEARCHED[:1]) is None, "one parameter has no plane"
    table = live_parameters(history(), SEARCHED)
    assert table is not None and len(table.rows) == 2 and live_parameters({}, SEARCHED) is None


@pytest.mark.parametrize("count", [2, LIVE_POINTS, LIVE_POINTS + 1, 2928, 10_000])
def test_a_long_search_is_drawn_with_few_points_and_its_newest(count: int) -> None:
    drawn = live_convergence(history(count))
    assert drawn is not None
    for trace in drawn["data"]:
        assert LIVE_POINTS / 2 <= len(trace["x"]) <= LIVE_POINTS or len(trace["x"]) == count
        assert trace["x"][-1] == count - 1


def test_one_step_is_no_convergence() -> None:
    assert live_convergence(history(1)) is None and live_descent({"all": [2.0]}) is None
    drawn = live_descent({"one step": [2.0], "three": [3.0, 2.0, 1.0]})
    assert drawn is not None and [t["name"] for t in drawn["data"]] == ["three"]


def test_signals_that_stay_the_same_are_told_in_words() -> None:
    still = np.zeros(len(SECOND))
    channels = {"theta1": np.sin(SECOND), "u1": still, "deflection1": still + 2e-3}
    recording = Recording("r", SECOND, channels)
    assert len(preview(recording)["data"]) == 1
    assert constants(recording).replace("\xa0", " ") == "Constant: u₁ 0 N m, δ₁ 2.00 mrad."
    at_rest = Recording("r", SECOND, {"theta1": still})
    assert len(preview(at_rest)["data"]) == 1 and not constants(at_rest), "nothing else to draw"
    pictures = {"t": (SECOND, SECOND), "gain": (SECOND, still + 1.0), "x": (SECOND, SECOND)}
    drawn = as_in_file(pictures, "t", ["gain"])
    assert drawn is not None and len(drawn["data"]) == 1
    assert constant_columns(pictures, "t") == "Constant: gain 1."


def test_the_papers_local_means_are_the_means_of_its_rows() -> None:
    for told in (SNR_NONE, SNR_20):
        rows = np.array(told)
        assert rows[:MEAN, 0].mean() == pytest.approx(rows[MEAN, 0], abs=LAST_DIGIT)


def test_a_glocal_result_stands_in_its_row_only() -> None:
    table = paper_table([fit("all", 1.01e9)], (), noisy=True)
    filled = [k for k, row in enumerate(table.rows) if row.strong]
    assert filled == [GLOCAL]
    assert table.rows[GLOCAL].cells[2] == "1.0100"


def test_local_results_stand_at_their_working_points_with_their_mean() -> None:
    fits = [fit("a", 0.9e9), fit("b", 1.1e9)]
    table = paper_table(fits, (np.pi / 4, 3 * np.pi / 8), noisy=False)
    assert [k for k, row in enumerate(table.rows) if row.strong] == [1, 2, MEAN]
    assert table.rows[MEAN].cells[2] == "1.0000"


def test_preview_fits_the_panel_and_shades_what_does_not_count() -> None:
    time = np.arange(1000) * 1e-3
    names = ("dtheta1_ref", "u1", "theta1", "z1", "ydot1", "y1", "deflection1")
    counted = {"z1": (time < 0.2) | (time > 0.4)}
    recording = Recording("r", time, {n: np.sin(9 * time) for n in names}, counted=counted)
    figure = preview(recording)
    rows = [k for k in figure["layout"] if k.startswith("yaxis")]
    assert len(rows) == ROWS
    (band,) = figure["layout"]["shapes"]
    assert (band["x0"], band["x1"]) == pytest.approx((0.2, 0.4), abs=2e-3)


def test_signals_are_picked_by_groups() -> None:
    """Also those that do not fit until others are left out."""
    names = ("dtheta1_ref", "u1", "u2", "theta1", "z1", "ydot1", "y1", "deflection1", "strain1")
    recording = Recording("r", SECOND, {n: np.sin(9 * SECOND) for n in names})
    shown = groups(recording)
    assert [g for g, drawn in shown.items() if drawn] == [
        "references", "torques", "joint angles", "tip", "deflections",
    ]  # fmt: skip
    strain = next(g for g in shown if g.startswith("strain"))
    assert not shown[strain] and not shown["fictitious rigid arm"]
    figure = preview(recording, picked=["torques", strain])
    rows = [k for k in figure["layout"] if k.startswith("yaxis")]
    assert len(rows) == 2 and len(figure["data"]) == 3


def test_html_escapes_every_text() -> None:
    evil = "<img src=x onerror=alert(1)>"
    table = Table((Column(evil),), (Row((evil,)),), evil)
    page = html_table(table) + html_equations([Equation(evil, rf"\text{{{evil}}}", evil)])
    assert isinstance(page, Markup)
    assert "<img" not in page
