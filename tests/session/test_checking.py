"""The check beside each recording: what it says, and what one button mends."""

from __future__ import annotations

import io
import tomllib

import numpy as np
import pandas as pd
import pytest

from flexgui.core.check.finding import Finding
from flexgui.core.scenario.read import scenario_toml
from flexgui.session.session import Session
from flexgui.stages.data.panel_recording import wording_of
from flexgui.views.preview import finding_html, title_of
from flexgui.views.sketch import sparkline
from tests.session.helpers import bring, good_csv, until


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


def test_what_is_dismissed_is_gone_from_the_page_and_stays_in_the_scenario(
    stated: Session,
) -> None:
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
