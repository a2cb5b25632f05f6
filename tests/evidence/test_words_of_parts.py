"""How the evidence judges and draws: parts that cannot run say why, and figures are files."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.evidence import frame
from tests.evidence.emps_rules import Table
from tests.evidence.engine_words import first_right, misses, set_right, text
from tests.evidence.figures import beside, confusion, ladder, svg
from tests.evidence.slide_run import NAMES, fitted_over, free_error

pytestmark = pytest.mark.long

SLIDE = np.array([95.0, 200.0, 20.0, -40.0])
"""kg, N s/m, N, N s/m."""
FOLLOWS = 0.01
"""mm: a run from its own force, started by a straight line through 20 samples at rest."""
BACK = 0.02
"""Relative: what filters at the ends of the windows cost the smallest parameter."""
SAMPLES, STEP = 4000, 1e-3


def one(truth: dict[str, Any], first: str | None, named: list[str], **values: float) -> Any:
    return {
        "truth": truth, "first": first, "added": [first] if first else [], "named": named,
        "values": values, "tip_mm": [1.0, 0.05], "final_verdict": "nothing_missing", "seconds": 9.0,
    }  # fmt: skip


VISCOUS = {"viscous_friction": {"fv1": 2.0}}
DRY = {"coulomb_friction": {"fc1": 2.0}}


def test_a_size_is_right_within_five_per_cent_and_dry_friction_within_eight() -> None:
    near = one(VISCOUS, "viscous_friction", ["viscous_friction"], fv1=2.08)
    far = one(VISCOUS, "viscous_friction", ["viscous_friction"], fv1=2.14)
    dry = one(DRY, "coulomb_friction", ["coulomb_friction"], fc1=2.14)
    assert [bool(list(misses(x))) for x in (near, far, dry)] == [False, True, False]


def test_nothing_hidden_is_right_only_where_nothing_is_named() -> None:
    assert first_right(one({}, None, []))
    assert not first_right(one({}, "viscous_friction", ["viscous_friction"]))
    assert not set_right(one({}, "viscous_friction", ["viscous_friction"]))


def test_an_effect_too_many_is_wrong() -> None:
    assert not set_right(one(VISCOUS, "viscous_friction", ["tip_payload", "viscous_friction"]))


def test_wrong_cases_are_listed_with_what_was_named() -> None:
    said = text({"a/x": one(VISCOUS, "tip_payload", ["tip_payload"], mt2=0.1)}, ["a/x", "b/x"])
    assert "1 of 2 cases have a result" in said
    assert "a/x: named tip_payload; tip error 1.00 → 0.05 mm" in said


def test_a_case_that_failed_counts_as_not_right_and_each_arm_by_itself() -> None:
    right = one(VISCOUS, "viscous_friction", ["viscous_friction"], fv1=2.0)
    said = text({"a/x": right, "a/nothing": one({}, None, [])}, ["a/x", "a/nothing", "b/x"])
    assert "|  | all arms | a | b |" in said
    assert "comes first | 1 of 2 | 1 of 1 | 0 of 1 |" in said
    assert "as near as asked | 1 of 1 | 1 of 1 | – |" in said
    assert "nothing named | 1 of 1 | 1 of 1 | – |" in said


def test_a_part_without_its_packages_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    part = frame.parts()["peers_sysid"]
    monkeypatch.setattr(part, "NEEDS", ("no_such_package",))
    assert frame.cases(["peers_sysid"], tmp_path) == []
    said = frame.page(tmp_path, tmp_path / "nothing.jsonl")
    assert "it needs no_such_package; pip install '.[peers]'" in said


def test_many_cases_that_were_not_run_are_counted_not_listed(tmp_path: Path) -> None:
    said = frame.page(tmp_path, tmp_path / "nothing.jsonl")
    count = len(frame.parts()["engine"].CASES)
    assert f"Not run yet: {count} of {count} cases" in said


def test_a_change_of_what_a_part_is_made_with_runs_it_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = frame.digest("engine")
    monkeypatch.setattr(frame.parts()["engine"], "SOURCES", ("mujoco/chain.py",))
    assert frame.digest("engine") != before


@pytest.mark.parametrize(
    "draw",
    [
        lambda: ladder([("mass alone", 37.0), ("coulomb_friction", 9.0)], 0.3, "N"),
        lambda: beside(["a", "b"], [6.0, 5.0], [6.0, 4.0]),
        lambda: confusion([("nothing", "nothing"), ("backlash", "joint_elasticity")]),
    ],
)
def test_a_figure_is_the_same_file_every_time(draw: Any) -> None:
    drawn = svg(draw())
    assert drawn == svg(draw())
    assert ET.fromstring(drawn).tag.endswith("svg")


def slide() -> Table:
    """Run from rest under two sines: at rest for 0.1 s, then moving both ways."""
    time = STEP * np.arange(SAMPLES)
    force = 90.0 * np.sin(3.0 * time) + 40.0 * np.sin(7.0 * time)
    force[:100] = 0.0
    empty = np.zeros(SAMPLES)
    bare = Table(time, empty, empty, force, empty)
    place = -free_error(SLIDE, bare, 20, SAMPLES) / 1e3
    return Table(time, empty, np.concatenate([np.zeros(20), place]), force, empty)


def test_a_free_run_at_the_true_values_has_no_error() -> None:
    assert np.abs(free_error(SLIDE, slide(), 20, SAMPLES)).max() < FOLLOWS


def test_free_runs_over_windows_give_the_values_back() -> None:
    found = fitted_over(slide(), 1000, 1.1 * SLIDE, 20, SAMPLES)
    assert dict(zip(NAMES, found, strict=True)) == pytest.approx(
        dict(zip(NAMES, SLIDE, strict=True)), rel=BACK
    )
