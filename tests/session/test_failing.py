"""Where the model fails: floors, board and the error along the time."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.results import (
    MISSING,
    NOTHING,
    ChannelComparison,
    Diagnosis,
    LadderStep,
    RecordingComparison,
    WorstCell,
)
from flexgui.stages.compare.panel_plots import WORDS
from flexgui.stages.compare.state import where_it_fails
from flexgui.stages.data.rigs import point_name
from flexgui.stages.diagnose.model_versions import ModelFindings
from flexgui.stages.diagnose.panel_candidates import may_explain
from flexgui.views.error_map import error_text

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
        error_text({"theta1": 1.5, "camera": 20.0}) == "error now: θ₁ 1.5, camera 20 × noise floor"
    )


def test_an_exact_sensor_has_a_floor_all_the_same() -> None:
    exact = seen("a", 1.0, {"theta1": 1e-12})
    assert where_it_fails((exact,), None).floors["theta1"] > 1e-4, "a thousandth of its motion"


def test_only_what_is_twice_its_noise_stands_out() -> None:
    cells = [
        WorstCell("a < b", "theta2", "rad", "frequency", "Hz", 0.0, 3.9, 1e-3, ratio)
        for ratio in (1.9, 28.0)
    ]
    assert "Nothing stands out." in WORDS.worst(cells[:1], None)
    table = WORDS.worst(cells[1:], cells[1])
    assert "a &lt; b" in table and "0 to 3.9 Hz" in table and "aria-current" in table
    assert "Nothing stands out" not in table and "theta2" not in table


def test_the_first_working_point_is_named_as_people_write_it() -> None:
    assert point_name(np.pi / 8) == "θ2 = π/8"
    assert point_name(3 * np.pi / 8) == "θ2 = 3π/8"


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
