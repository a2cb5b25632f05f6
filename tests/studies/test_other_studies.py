"""The studies of nothing hidden and of planned experiments: what they draw, and how they count."""

from __future__ import annotations

from typing import Any

import pytest

from flexgui.core.arm.presets import presets
from flexgui.core.scenario.schema import Scenario
from tests.studies import next_experiments, nothing_hidden
from tests.studies.nothing_hidden import SEEDS, SHIPPED, cases, document

pytestmark = pytest.mark.long


def test_every_shipped_scenario_and_preset_is_tried_with_nothing_hidden() -> None:
    listed = cases(SEEDS)
    assert len({c.key for c in listed}) == SEEDS == 100
    assert {c.what for c in listed} == {*SHIPPED, *(f"preset {name}" for name in presets())}
    levels, filters = set(), set()
    for case in listed[:30]:
        scenario = Scenario.model_validate(document(case))
        assert not any(r.hidden for r in scenario.recordings) and not scenario.model.effects
        levels.add(scenario.model.level)
        filters.add(scenario.identify.filter is None)
    assert levels == {"auto", "lpv", "nonlinear"} and filters == {True, False}


def record(key: str, added: list[str], level: str = "nonlinear") -> dict[str, Any]:
    values = {f"effect {k}": (k + 0.5) / 10 for k in range(10)}
    answer = {"added": added, "final_verdict": "nothing_missing", "p_values": values}
    return {"key": key, "level": level, "snr_db": 20.0, "filter": None, "answer": answer}


def test_false_alarms_are_counted_and_named() -> None:
    failed = {"key": "demo/3", "failed": "InputError: x"}
    text = nothing_hidden.tables([record("demo/1", []), record("demo/2", ["backlash"]), failed])
    assert "1 of 3 name nothing" in text
    assert "demo/2: backlash; level nonlinear" in text and "demo/3: InputError: x" in text
    assert "20 p-values by tenths: 2 2 2 2 2 2 2 2 2 2" in text


def test_a_stated_linear_model_is_no_witness_of_p_values() -> None:
    assert "p-values" not in nothing_hidden.tables([record("demo/1", [], level="lpv")])


def test_violated_limits_and_near_deviations_are_counted() -> None:
    good = {"key": "1", "used": [0.9], "seconds": 2.0, "deviations": {"EI1": [2.0, 1.0, 1.1]}}
    bad = {"key": "2", "used": [1.2], "seconds": 3.0, "deviations": {"EI1": [2.0, 1.0, 1.5]}}
    text = next_experiments.tables([good, bad, {"key": "3", "failed": "ValueError: x"}])
    assert "2 of 3 rigs planned" in text and "3: ValueError: x" in text
    assert "limits violated on 1 rigs (asked: none): 2" in text
    assert "of the predicted: 1 of 2" in text
