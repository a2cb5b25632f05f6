"""A rig is stated in one sheet: arm, drive and sensors, or a sentence on what is wrong."""

from __future__ import annotations

import json

import pytest

from flexgui.core.arm.build import build_arm
from flexgui.core.errors import InputError
from flexgui.core.scenario.schema import Scenario
from flexgui.library.shipped import demo_scenario
from flexgui.page.scene_panel import exaggeration, measured_arm
from flexgui.session.scenario_edits import apply_edits, cached_model, set_value
from flexgui.session.session import Session
from flexgui.stages.data.rig_sheet import is_stated, sheet_edit, sheet_rows, with_links
from flexgui.stages.data.rigs import RIGS, rig_edit
from tests.session.helpers import bring, good_csv

MINE = {
    "segments.length.0": "0,7", "segments.EI.0": "630", "segments.EI.1": "195",
    "segments.hub_inertia.0": ".08", "drive.gains.0": "8e1", "arm.gravity.1": "−9.81",
    "sensors.camera_noise.0": "0.05",
}  # fmt: skip


def stated(scenario: Scenario, **entries: str) -> Scenario:
    return apply_edits(scenario, sheet_edit(scenario, {**MINE, **entries}))


def test_entries_of_all_parts_are_taken_in_their_units() -> None:
    made = stated(demo_scenario())
    arm = build_arm(made.arm)
    assert [s.length for s in arm.segments] == [0.7, 0.5]
    assert [s.EI for s in arm.segments] == [630.0, 195.0]
    assert arm.segments[0].hub_inertia == 0.08 and arm.gravity == (0.0, -9.81)
    assert tuple(made.drive.options["gains"]) == (80.0, 30.0)
    assert made.sensors.camera_noise == pytest.approx(5e-5)


def test_what_can_be_estimated_follows_and_its_bounds_lie_around_what_is_stated() -> None:
    made = stated(demo_scenario())
    assert made.identify.parameters == ("EI1", "EI2")
    second = cached_model(made).parameters["EI2"]
    assert second.value == 195.0 and second.lower < 195.0 < second.upper
    assert second.lower == pytest.approx(195.0 / 10.0)


def test_a_sheet_that_nobody_touched_changes_only_that_the_arm_is_stated() -> None:
    before = demo_scenario()
    texts = {r.key(k): r.text(k) for r in sheet_rows(before) for k in range(len(r.values))}
    after = apply_edits(before, sheet_edit(before, texts))
    assert not is_stated(before) and is_stated(after)
    assert build_arm(after.arm).segments == build_arm(before.arm).segments
    assert after.model_copy(update={"arm": before.arm}) == before


def test_an_empty_stiffness_makes_a_link_rigid() -> None:
    made = build_arm(stated(demo_scenario(), **{"segments.EI.0": ""}).arm)
    assert made.modes == (0, 1)


def test_a_rigid_link_is_stated_as_a_data_sheet_has_it() -> None:
    rigid = stated(demo_scenario(), **{"segments.EI.0": ""})
    sheet = {"segments.centre_of_mass.0": "0.3", "segments.inertia.0": "0.08"}
    assert set(sheet) <= {r.key(0) for r in sheet_rows(demo_scenario())}
    first = build_arm(apply_edits(rigid, sheet_edit(rigid, sheet)).arm).segments[0]
    assert first.centre == (0.3, 0.0) and first.central_inertia == 0.08
    with pytest.raises(InputError, match="segment 2: inertia is for a rigid segment"):
        apply_edits(rigid, sheet_edit(rigid, {"segments.inertia.1": "0.08"}))


@pytest.mark.parametrize("rig", [rig.title for rig in RIGS])
def test_every_rig_has_a_sheet_that_can_be_stated(rig: str) -> None:
    kind = next(r for r in RIGS if r.title == rig)
    scenario = apply_edits(demo_scenario(), rig_edit(demo_scenario(), kind))
    texts = {r.key(k): r.text(k) for r in sheet_rows(scenario) for k in range(len(r.values))}
    cached_model(apply_edits(scenario, sheet_edit(scenario, texts)))


@pytest.mark.parametrize("count", [1, 3])
def test_another_number_of_links_is_a_rig_with_as_many_gains(count: int) -> None:
    made = apply_edits(demo_scenario(), with_links(demo_scenario(), count))
    model = cached_model(made)
    assert model.arm.joints == count == len(made.drive.options["gains"])
    assert set(made.identify.parameters) <= set(model.parameters)
    assert not made.recordings, "they were simulated with the other arm"


@pytest.mark.parametrize(
    ("field", "text", "words"),
    [
        ("segments.mass.1", "five", "Mass of link 2: 'five' is not a number."),
        ("segments.modes.0", "1.5", "Bending modes of link 1: '1.5' is not a whole number."),
        ("segments.length.0", "", "Length of link 1: a number is needed."),
        ("drive.limits.0", "40", "Largest torque: give one number per joint, or none at all."),
        ("segments.mass.0", "-1", "mass of segment 1"),
    ],
)  # fmt: skip
def test_a_wrong_entry_is_named(field: str, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        cached_model(stated(demo_scenario(), **{field: text}))


def test_own_recordings_ask_for_the_rig_and_are_drawn_plainly_until_then(session: Session) -> None:
    content = good_csv(session)
    assert not session.recordings.rig.is_asked
    assert session.recordings.upload("bench3.csv", content).result()
    assert session.recordings.rig.is_asked
    session.show("Data")
    session.playback.refresh()
    assert session.wait_idle() and session.playback.motion is not None
    assert measured_arm(session, session.playback.motion) is None and exaggeration(session) == 1.0
    assert session.recordings.rig.state(json.dumps(MINE))
    assert not session.recordings.rig.is_asked
    assert session.document.scenario.title == "bench3"


def test_whoever_brings_a_scenario_has_stated_the_rig(session: Session) -> None:
    """Also where the arm in it is one that comes with the program, and a file is added later."""
    content = good_csv(session)
    (session.folder / "first.csv").write_bytes(content)
    mine = set_value(("recordings",), [{"file": "first.csv"}])
    assert session.open(apply_edits(demo_scenario(), mine))
    assert not is_stated(session.document.scenario) and not session.recordings.rig.is_asked
    assert bring(session, "second.csv", content)
    assert len(session.document.scenario.recordings) == 2
    assert not session.recordings.rig.is_asked


def test_refused_entries_stay_as_they_were_typed(session: Session) -> None:
    rig, before = session.recordings.rig, session.document.scenario
    assert not rig.state(json.dumps(MINE | {"segments.mass.0": "x"}))
    assert rig.refused["segments.mass.0"] == "x" and "Mass of link 1" in rig.complaint
    assert session.document.scenario is before
    assert rig.state(json.dumps(MINE)) and not rig.complaint


def test_a_title_follows_the_files_and_leaves_a_persons_own(session: Session) -> None:
    content = good_csv(session)
    for name in ("run_1.csv", "run_2.csv"):
        assert session.recordings.upload(name, content).result()
    assert session.document.scenario.title == "run"
    assert session.document.change(lambda document: document.update(title="Mine"))
    assert session.recordings.upload("run_3.csv", content).result()
    assert session.document.scenario.title == "Mine"
