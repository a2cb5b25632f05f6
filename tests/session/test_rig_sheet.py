"""A rig is stated in one sheet, or a sentence says what is wrong; recordings are checked by it."""

from __future__ import annotations

import io
import json
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexgui.core.arm.build import build_arm
from flexgui.core.check.finding import Finding
from flexgui.core.errors import InputError
from flexgui.core.scenario.read import read_scenario, scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.library.shipped import demo_scenario
from flexgui.page.scene_panel import exaggeration, measured_arm
from flexgui.session.scenario_edits import apply_edits, cached_model, set_value
from flexgui.session.session import Session
from flexgui.stages.data.panel_recording import wording_of
from flexgui.stages.data.panel_rig import tables
from flexgui.stages.data.rig_sheet import estimated, is_stated, sheet_edit, sheet_rows, with_links
from flexgui.stages.data.rigs import RIGS, rig_edit
from flexgui.views.preview import finding_html, title_of
from flexgui.views.sketch import sparkline
from tests.session.helpers import bring, good_csv, until

SUPPLIED = sorted((Path(__file__).resolve().parents[2] / "scenarios").glob("*.toml"))

MINE = {
    "segments.length.0": "0,7", "segments.EI.0": "630", "segments.EI.1": "195",
    "segments.hub_inertia.0": ".08", "drive.gains.0": "8e1", "arm.gravity.1": "−9.81",
    "sensors.camera_noise.0": "0.05",
}  # fmt: skip


def with_sheet(scenario: Scenario, **entries: str) -> Scenario:
    return apply_edits(scenario, sheet_edit(scenario, {**MINE, **entries}))


def test_entries_of_all_parts_are_taken_in_their_units() -> None:
    made = with_sheet(demo_scenario())
    arm = build_arm(made.arm)
    assert [s.length for s in arm.segments] == [0.7, 0.5]
    assert [s.EI for s in arm.segments] == [630.0, 195.0]
    assert arm.segments[0].hub_inertia == 0.08 and arm.gravity == (0.0, -9.81)
    assert tuple(made.drive.options["gains"]) == (80.0, 30.0)
    assert made.sensors.camera_noise == pytest.approx(5e-5)


@pytest.mark.parametrize("path", SUPPLIED, ids=lambda path: path.stem)
def test_every_supplied_scenario_has_a_sheet_with_all_its_rows(path: Path) -> None:
    """Two real rigs, whose gauges have a stated place, left the page without its stage Data."""
    rows = sheet_rows(read_scenario(path))
    parts = tables(rows)
    assert sorted(map(id, rows)) == sorted(id(row) for *_, part in parts for row in part)
    assert all(len(row.values) == count for _, count, part in parts for row in part)


def test_what_can_be_estimated_follows_and_its_bounds_lie_around_what_is_stated() -> None:
    made = with_sheet(demo_scenario())
    assert made.identify.parameters == ("EI1", "EI2")
    second = cached_model(made).parameters["EI2"]
    assert second.value == 195.0 and second.lower < 195.0 < second.upper
    assert second.lower == pytest.approx(195.0 / 10.0)


def test_what_a_fit_does_not_take_as_stated_stands_in_the_sheet() -> None:
    """A mass that was estimated unsaid hid that another one was wrong."""
    rigid = with_sheet(demo_scenario(), **{"segments.EI.0": "", "segments.EI.1": ""})
    assert rigid.identify.parameters == ("m1",)
    assert estimated(rigid) == "mass of segment 1 (m1)"
    assert estimated(apply_edits(rigid, set_value(("identify", "parameters"), []))) == ""


def test_a_sheet_that_nobody_touched_changes_only_that_the_arm_is_stated() -> None:
    before = demo_scenario()
    texts = {r.key(k): r.text(k) for r in sheet_rows(before) for k in range(len(r.values))}
    after = apply_edits(before, sheet_edit(before, texts))
    assert not is_stated(before) and is_stated(after)
    assert build_arm(after.arm).segments == build_arm(before.arm).segments
    assert after.model_copy(update={"arm": before.arm}) == before


def test_a_rigid_link_is_stated_as_a_data_sheet_has_it() -> None:
    rigid = with_sheet(demo_scenario(), **{"segments.EI.0": ""})
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
        cached_model(with_sheet(demo_scenario(), **{field: text}))


def test_a_length_is_held_against_the_recorded_tip_as_soon_as_it_is_stated(
    session: Session,
) -> None:
    assert session.recordings.upload("bench3.csv", good_csv(session)).result()
    session.playback.refresh()
    assert session.wait_idle()
    rig, check = session.recordings.rig, session.check
    assert rig.state(json.dumps({"segments.length.0": "60"}))
    assert "(EI1)" in session.message.text, "what a fit frees is said where the rig is stated"
    until(lambda: check.is_checked and not check.running)
    (found,) = (f for f in check.findings_of("bench3") if f.fault == "stated_length")
    assert "length of segment 1 is 60 m; camera and encoders show 0.5 m" in found.evidence


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


def spoilt(session: Session) -> bytes:
    """Joint 1 in degrees, the camera in millimetres; no heading says so."""
    table = pd.read_csv(io.BytesIO(good_csv(session)))
    table["theta1"] = np.degrees(table["theta1"])
    table["z1 [m]"] *= 1e3
    text: str = table.rename(columns={"z1 [m]": "z1"}).to_csv(index=False)
    return text.encode()


def checked(session: Session) -> bool:
    return session.check.is_checked and not session.check.running


@pytest.fixture
def brought(session: Session) -> Session:
    assert bring(session, "rig.csv", spoilt(session))
    assert session.recordings.rig.state("{}"), "nobody checks by an arm that is only an example"
    until(lambda: checked(session))
    return session


@pytest.fixture
def stated(session: Session) -> Session:
    """With the same file in the scenario. Nobody looks at it first: bringing it takes ten seconds,
    and to mend a recording a session has to know its name."""
    (session.folder / "rig.csv").write_bytes(spoilt(session))
    assert session.document.change(
        lambda d: d["recordings"].append({"name": "rig", "file": "rig.csv"})
    )
    return session


@pytest.mark.long
def test_a_file_that_arrives_is_checked_and_mended_by_buttons(brought: Session) -> None:
    """Both faults at once; each is mended by its own button."""
    found = brought.check.findings_of("rig")
    assert [(f.fault, f.channel) for f in found] == [("degrees", "theta1"), ("millimetres", "z1")]
    assert wording_of(brought, "rig") == "2 findings"
    for finding in found:
        said = finding_html(finding)
        assert title_of(finding.fault) in said and "<svg" in said
        assert brought.check.mend(finding)
        until(lambda: checked(brought))
    assert wording_of(brought, "rig") == "good"
    columns = brought.document.scenario.recordings[-1].columns
    names = {c: entry.name for c, entry in columns.items()}
    assert names == {"theta1": "theta1 [deg]", "z1": "z1 [mm]"}
    assert len(brought.check.mended["rig"]) == 2
    written = tomllib.loads(scenario_toml(brought.document.scenario))
    assert "theta1 [deg]" in str(written["recordings"][-1]["columns"])
    swap = 'columns = { theta1 = "theta2", theta2 = "theta1" }'
    assert brought.check.mend(Finding("swapped_joints", "rig", "theta1", 1.0, "", "Said.", swap))
    columns = brought.document.scenario.recordings[-1].columns
    assert columns["theta2"].name == "theta1 [deg]"  # a column keeps its unit
    assert columns["theta1"].name == "theta2"
    assert not brought.check.is_checked and wording_of(brought, "rig") in ("", "…")


def test_a_second_factor_comes_on_top_of_the_first(stated: Session) -> None:
    for sign, gain in ((-1, 2.0), (1, 4.0)):
        line = 'columns = { theta2 = { name = "theta2", sign = -1, gain = 2.0 } }'
        assert stated.check.mend(Finding("sign", "rig", "theta2", -1.0, "", "Said.", line))
        entry = stated.document.scenario.recordings[-1].columns["theta2"]
        assert (entry.sign, entry.gain) == (sign, gain)


def test_what_is_dismissed_is_gone_from_the_page_and_stays_in_the_scenario(stated: Session) -> None:
    finding = Finding("outliers", "rig", "z1", 3.0, "samples", "Said.")
    assert stated.check.dismiss(finding)
    assert stated.document.scenario.recordings[-1].dismissed == ("z1: outliers",)
    assert "z1: outliers" in scenario_toml(stated.document.scenario)
    assert not stated.check.dismiss(Finding("outliers", "gone", "z1", 3.0, "", "Said."))


def test_what_cannot_be_mended_changes_nothing(stated: Session) -> None:
    before = stated.document.scenario
    assert not stated.check.mend(Finding("delay", "rig", "z1", 0.1, "s", "Said."))
    assert not stated.check.mend(Finding("sign", "gone", "z1", 0.1, "s", "Said.", "x = 1"))
    assert not stated.check.mend(Finding("sign", "rig", "z1", 0.1, "s", "Said.", "x = ["))
    assert stated.document.scenario == before


def test_a_sparkline_breaks_at_gaps_and_escapes_its_title() -> None:
    t = np.arange(100.0)
    values = np.sin(0.1 * t)
    values[40:60] = np.nan
    drawn = sparkline(t, values, title="<script>")
    assert drawn.count("M") == 2 and "<script>" not in drawn
    assert sparkline(t, np.full(100, np.nan)) == ""


def test_a_title_follows_the_files_and_leaves_a_persons_own(session: Session) -> None:
    content = good_csv(session)
    for name in ("run_1.csv", "run_2.csv"):
        assert session.recordings.upload(name, content).result()
    assert session.document.scenario.title == "run"
    assert session.document.change(set_value(("title",), "Mine"))
    assert session.recordings.upload("run_3.csv", content).result()
    assert session.document.scenario.title == "Mine"


LOOPED = {
    "title": "gauges", "arm": {"preset": "paper"},
    "drive": {"kind": "velocity_loop", "gains": [60.0, 30.0]},
}  # fmt: skip
GAUGES = {"strain1": {"name": "eps", "gain": 1e-6}}


def test_where_a_recorded_gauge_sits_is_stated_in_the_sheet() -> None:
    before = Scenario.model_validate(
        {**LOOPED, "recordings": [{"name": "r", "file": "r.csv", "columns": GAUGES}]}
    )
    keys = {row.key(0) for row in sheet_rows(before)}
    assert {"sensors.strain_noise.0", "sensors.strain1.place.0"} <= keys
    assert not {"sensors.gyro_noise.0", "sensors.gyro1.place.0"} & keys
    entries = {"sensors.strain1.distance.0": "1.5", "sensors.strain_noise.0": "2"}
    document = before.model_dump(exclude_unset=True)
    sheet_edit(before, entries)(document)
    after = Scenario.model_validate(document).sensors
    assert after.mounts["strain1"].distance == pytest.approx(1.5e-3)
    assert after.noise_of("strain_noise") == pytest.approx(2e-6)
