"""What a finding says of its weight, and what is no fault where something else explains as much."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
import pytest

from flexgui.core.check import comparison
from flexgui.core.check.column_fault import ColumnFault
from flexgui.core.check.comparison import Comparison
from flexgui.core.check.finding import Finding
from flexgui.core.check.measured_recording import MeasuredRecording
from flexgui.core.check.run_checks import check_all, check_scenario, measured_recordings
from flexgui.core.recording.recording import Recording
from flexgui.core.scenario.read import parse_scenario, read_scenario, scenario_toml
from tests.check.rigs import SCENARIOS
from tests.check.test_unknown_stiffness import rig_of, shifted
from tests.programs.sample.cases import cases
from tests.programs.studies.plain_matrix_rigs import drawn


@pytest.fixture
def late() -> MeasuredRecording:
    return shifted(rig_of(4).cases[1].recording, "z2", 0.009)


def test_a_finding_says_what_it_explains_and_how_sure_it_is(late: MeasuredRecording) -> None:
    (one,) = check_all([late])
    assert one.is_fault and one.fault == "delay"
    assert "standard deviation" in one.evidence
    assert "Once this is corrected, the unexplained part of z2 falls from" in one.evidence
    assert one.picture is not None and one.picture.expected is not None
    apart = one.picture.shown - one.picture.expected
    assert 0.0 < np.nanstd(apart) < np.nanstd(one.picture.shown)


def test_sizes_are_left_to_a_diagnosis(late: MeasuredRecording) -> None:
    assert check_all([late], sized=False) == []


def test_where_identified_values_leave_noise_nothing_is_looked_for(asked: list[int]) -> None:
    recording = rig_of(2).cases[0].recording
    true = {s: seg["EI"] for s, seg in zip(("EI1", "EI2"), drawn(2).segments, strict=True)}
    assert check_all([replace(recording, values={**true, "tau1": 0.0, "tau2": 0.0})]) == []
    assert sum(asked) == 1


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many answers of a model each call asks for."""
    counts: list[int] = []
    plain = Comparison.answers

    def counted(self: Comparison, of: list[tuple[object, np.ndarray]]) -> list[object]:
        counts.append(len(of))
        return plain(self, of)  # type: ignore[arg-type,return-value]

    monkeypatch.setattr(comparison.Comparison, "answers", counted)
    return counts


def test_what_is_wrong_with_one_recording_is_named_in_all_that_share_it(asked: list[int]) -> None:
    """And is searched for once."""
    recordings = [case.recording for case in rig_of(2).cases]
    wrong = [replace(r, channels={**r.channels, "z1": -r.channels["z1"]}) for r in recordings]
    first = check_all(wrong[:1])
    alone = sum(asked)
    said = check_all(wrong)
    assert [(f.recording, f.fault) for f in said] == [(r.name, "sign") for r in wrong]
    assert [f.fault for f in first] == ["sign"]
    assert sum(asked) - alone < 1.2 * alone


def test_a_fault_of_one_recording_is_not_laid_on_another() -> None:
    one, two, *_ = (case.recording for case in rig_of(4).cases)
    wrong = replace(one, channels={**one.channels, "z1": -one.channels["z1"]})
    assert [f.recording for f in check_all([wrong, two])] == [one.name]
    assert [f.recording for f in check_all([two, wrong])] == [one.name]


@cache
def _loaded() -> tuple[Finding, ...]:
    """Of an arm with a payload that the scenario does not state."""
    case = cases()["engine/one/tip_payload=0.2"]
    with TemporaryDirectory() as folder:
        path = case.write(Path(folder))
        return tuple(check_scenario(read_scenario(path), path.parent))


@pytest.mark.long
def test_a_missing_effect_makes_a_question_and_no_fault() -> None:
    """A payload makes the camera seem late."""
    assert not any(finding.is_fault for finding in _loaded())
    assert _loaded() and all("missing effect" in finding.evidence for finding in _loaded())


def test_recordings_in_which_nothing_moves_are_dead_and_nothing_else() -> None:
    def still(x: np.ndarray) -> np.ndarray:
        return np.full(len(x), x[np.isfinite(x)][0])

    moved = [case.recording for case in rig_of(2).cases[:2]]
    resting = [replace(r, channels={n: still(x) for n, x in r.channels.items()}) for r in moved]
    assert {finding.fault for finding in check_all(resting)} == {"dead"}


def test_what_does_not_count_moves_with_its_column() -> None:
    counts = np.array([True, False, True])
    recording = Recording(
        "r", np.arange(3.0), {"theta1": np.zeros(3), "theta2": np.ones(3)},
        counted={"theta1": counts, "theta2": ~counts},
    )  # fmt: skip
    swapped = ColumnFault("swapped_joints", ("theta1", "theta2"), swapped="12")
    found = swapped.corrected(recording)
    assert (found["theta1"] == 1.0).all() and (found.counted["theta1"] == ~counts).all()


@pytest.mark.parametrize(
    "first, second", [({"lag": 7e-3}, {"lag": 13e-3}), ({"shift": 0.2}, {"shift": -0.05}),
                      ({"factor": 2.0}, {"factor": 1.5})]
)  # fmt: skip
def test_a_fault_that_was_found_in_two_parts_is_taken_back_as_a_whole(
    first: dict[str, float], second: dict[str, float]
) -> None:
    time = 1e-3 * np.arange(500)
    recording = Recording("r", time, {"theta1": np.cos(9.0 * time)})
    one, other = (ColumnFault("part", ("theta1",), is_usual=False, **k) for k in (first, second))
    apart = other.corrected(one.corrected(recording))["theta1"]
    assert one.with_more(other).corrected(recording)["theta1"] == pytest.approx(apart, abs=1e-3)


def test_what_is_dismissed_is_not_said_again(tmp_path: Path) -> None:
    scenario = read_scenario(SCENARIOS / "hidden_friction.toml")
    found = measured_recordings(scenario, SCENARIOS)[0]
    table = pd.DataFrame({"t": found.time, **found.channels})
    table["z1"] *= -1.0
    table.to_csv(tmp_path / "rig.csv", index=False)
    alone = scenario.model_copy(update={"recordings": ()})
    text = scenario_toml(alone) + '\n[[recordings]]\nname = "rig"\nfile = "rig.csv"\n'
    (one,) = check_scenario(parse_scenario(text, "rig"), tmp_path)
    assert one.key == "z1: sign"
    dismissed = parse_scenario(text + f'dismissed = ["{one.key}"]\n', "rig")
    assert check_scenario(dismissed, tmp_path) == []
