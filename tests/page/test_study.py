"""The study with real clicks: started, watched, stopped, gone on with, taken away."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import pytest

from flexgui.core.scenario.read import read_scenario
from flexgui.session.session import Session
from flexgui.stages.data.uploads import fetch_files
from flexgui.stages.diagnose.model_versions import ModelVersion
from flexgui.stages.study.panel import OPEN
from tests.montecarlo.helpers import short
from tests.page.helpers import enter, plots, press, sees
from tests.page.test_diagnose import few
from tests.session.helpers import until

pytestmark = pytest.mark.long

RECORDED = Path(__file__).resolve().parents[2] / "scenarios" / "mujoco" / "tip_payload.toml"

MANY = "200"
"""Runs that last until the test stops them."""


def test_from_the_button_to_the_tables(page: Any, session: Session, tmp_path: Path) -> None:
    assert session.open(short().scenario)
    press(page, "Study")
    sees(page, "10 cases; 5 runs at 3 working points")
    enter(page, "Runs", MANY)
    sees(page, "400 cases")
    press(page, "Start the study")
    sees(page, "Estimates at SNR ∞")
    page.get_by_text(re.compile("of 400 cases, about")).first.wait_for()
    assert session.study.state.busy
    until(lambda: "here, SNR ∞" in plots(page))
    press(page, "Stop")
    page.get_by_text(re.compile(r"Stopped: \d+ of 400 cases")).first.wait_for()
    found = session.study.state.done
    runs = found // 2 + 2
    enter(page, "Runs", str(runs))
    press(page, "Go on with the study")
    page.get_by_text(f"Finished: {2 * runs} of {2 * runs} cases").first.wait_for(timeout=120_000)
    assert session.study.state.before >= found
    with page.expect_download() as download:
        press(page, "Save the results (zip)")
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    assert path.name.endswith("_study.zip")
    with zipfile.ZipFile(path) as archive:
        assert {"study.html", "estimates.csv", "result.json"} <= set(archive.namelist())


def test_a_scenario_that_cannot_be_studied_says_what_to_do(page: Any, session: Session) -> None:
    scenario = read_scenario(RECORDED)
    assert session.open(fetch_files(scenario, RECORDED.parent, None, session.folder))
    press(page, "Study")
    sees(page, "which is a file")
    assert not page.get_by_role("button", name="Start the study").is_visible()
    press(page, OPEN)
    press(page, "Replace my work")
    sees(page, "10 cases; 5 runs at 7 working points")


def test_work_is_replaced_only_after_a_question(page: Any, session: Session) -> None:
    few(session)
    session.diagnosis.versions = (ModelVersion(session.document.scenario),)
    before = session.document.scenario
    press(page, "Study")
    press(page, OPEN)
    sees(page, "Replace them?")
    press(page, "Keep my work")
    page.get_by_text("Replace them?").wait_for(state="detached")
    assert session.document.scenario == before
    press(page, OPEN)
    press(page, "Replace my work")
    until(lambda: session.document.scenario != before)
