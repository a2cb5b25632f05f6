"""The plain matrix: what its scenarios state, and how answers are judged."""

from __future__ import annotations

from typing import Any

import pytest

from flexgui.core.scenario.schema import Scenario
from tests.studies.plain_matrix import CASES, COUNTS, STAND_INS, cases
from tests.studies.plain_matrix_judge import judged, tables
from tests.studies.plain_matrix_rigs import drawn

pytestmark = pytest.mark.long

SEEDS = range(1, 13)


def answer(**more: Any) -> dict[str, Any]:
    return {
        "verdict": "missing", "final_verdict": "nothing_missing", "added": [], "kept": [],
        "confused": {}, "rms": 1.0, "validation": [], "parameters": {}, "origins": {},
        "p_values": {},
    } | more  # fmt: skip


def test_there_are_as_many_cases_as_asked_for() -> None:
    every = cases(CASES, ("hidden", "outside", "stand_in"))
    assert len(every) == CASES + 4 * STAND_INS == len({c.key for c in every})
    assert {int(c.what) for c in every if c.part == "hidden"} == {0, 1, 2, 3, 4}
    assert sum(c.part == "outside" for c in every) == CASES * COUNTS.count(-1) // len(COUNTS)


def test_a_plain_scenario_states_arm_drive_files_and_parameters() -> None:
    for seed in SEEDS:
        document = drawn(seed).document()
        assert Scenario.model_validate(document)
        assert set(document) == {"title", "arm", "drive", "identify", "diagnose", "recordings"}
        assert set(document["identify"]) <= {"parameters", "filter"}
        assert set(document["drive"]) <= {"kind", "gains", "torque_constants"}


def test_the_stated_stiffness_is_a_third_off_or_four_times() -> None:
    rig = drawn(1)
    pairs = zip(rig.document()["arm"]["segments"], rig.segments, strict=True)
    ratios = [stated["EI"] / true["EI"] for stated, true in pairs]
    assert ratios == pytest.approx(list(rig.starts), rel=1e-4)
    assert all(x in (0.7, 1 / 0.7, 0.25, 4.0) for x in rig.starts)


def test_the_same_seed_draws_the_same_rig() -> None:
    assert drawn(3) == drawn(3) != drawn(4)


def test_a_set_is_right_when_it_is_the_hidden_one() -> None:
    hidden = ("coulomb_friction", "tip_payload")
    right = answer(added=["tip_payload", "coulomb_friction"], kept=list(hidden))
    found = judged(hidden, right, {})
    assert found["first"] and found["exact"] and not found["false_alarms"]
    less = judged(hidden, answer(added=["tip_payload"], kept=["tip_payload"]), {})
    assert less["first"] and not less["exact"] and less["missed"] == ["coulomb_friction"]


def test_what_an_effect_includes_is_part_of_the_truth_and_not_named_by_it() -> None:
    found = judged(
        ("stribeck_friction",),
        answer(added=["coulomb_friction"], kept=["coulomb_friction", "stribeck_friction"]),
        {},
    )
    assert found["first"] and found["exact"] and not found["missed"]


def test_a_stand_in_is_a_false_alarm_unless_it_was_declared() -> None:
    silent = answer(added=["drive_lag"], kept=["drive_lag"])
    found = judged(("camera_delay",), silent, {})
    assert not found["first"] and not found["exact"] and found["false_alarms"] == ["drive_lag"]
    honest = silent | {"confused": {"drive_lag": ["camera_delay"]}}
    assert judged(("camera_delay",), honest, {})["declared"]


def test_intervals_errors_and_unseen_recordings_are_judged() -> None:
    said = answer(
        rms=1.2, validation=[2.0, 3.0], parameters={"EI1": (10.0, 1.0), "EI2": (10.0, 1.0)}
    )
    found = judged((), said, {"EI1": 11.0, "EI2": 13.0})
    assert found["covered"] == {"EI1": True, "EI2": False}
    assert not found["within"] and found["worse"] and found["first"] is None


def test_the_tables_count_hits_and_say_what_was_asked() -> None:
    hidden = ("tip_payload",)
    said = answer(
        added=list(hidden), kept=list(hidden), parameters={"mt1": (1.0, 0.1)},
        origins={"mt1": "tip_payload"},
    )  # fmt: skip
    record = {
        "part": "hidden", "what": "1", "hidden": hidden, "answer": said,
        "judged": judged(hidden, said, {"mt1": 1.05}),
    }  # fmt: skip
    nothing = record | {"hidden": (), "answer": answer(p_values={"air_drag": 0.4})}
    nothing["judged"] = judged((), nothing["answer"], {})
    text = tables([record, nothing, {"part": "hidden", "unreachable": "x"}])
    assert "2 cases judged; 1 not to be told" in text
    assert "one exactly" in text and "100.0 %  1 of 1  (asked 95 %)" in text
    assert "tip_payload" in text and "by tenths: 0 0 0 0 1" in text
