"""A laboratory's file with names, units and faults of its own, to a right fit and to a verdict in a
few clicks."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from flexgui.core.arm.build import build_arm
from flexgui.core.results import MISSING, NOTHING, Outcome
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from tests.page.conftest import Desktop
from tests.page.helpers import plots, press, sees
from tests.page.test_walk import BOXES, SETTLED
from tests.session.helpers import LABORATORY, good_csv, laboratory_csv, until

CLICKS = 7
"""From the first page to a verdict."""
TRUE_EI = 520.83
"""N m^2, of the paper's arm, which made the recording."""
CLOSE = 0.02
"""Of the true value: one recording of three seconds."""
PATIENT = 240_000
"""ms for a search on a busy machine."""
LOW, PEAK = 3.0, 2.0
"""Hz, below the vibrations of the example; times the largest gain there."""
SIZES = ((1600, 900), (390, 844))


@pytest.fixture
def foreign(session: Session, tmp_path: Path) -> Path:
    """Other names, degrees, one gap and a swap."""
    path = tmp_path / "bench.csv"
    path.write_bytes(laboratory_csv(session))
    return path


class Clicks:
    """Presses buttons and counts."""

    def __init__(self, page: Any) -> None:
        self.page, self.count = page, 0

    def press(self, name: str) -> None:
        press(self.page, name)
        self.count += 1

    def upload(self, path: Path, button: str = "Upload a recording or a scenario") -> None:
        with self.page.expect_file_chooser() as chooser:
            self.press(button)
        chooser.value.set_files(path)

    def fit(self, session: Session) -> Outcome:
        """From the stage Data, where recordings stand."""
        self.press("Next: identify")
        self.press("Start identification")
        found = session.identification
        until(lambda: found.outcome is not None and not session.run.busy, PATIENT / 1000)
        assert found.outcome is not None
        return found.outcome


def shot(page: Any, name: str) -> None:
    """For eyes, where FLEXGUI_SHOTS names a folder."""
    folder = os.environ.get("FLEXGUI_SHOTS")
    if folder:
        page.wait_for_timeout(1500)
        page.screenshot(path=Path(folder) / f"import_{page.viewport_size['width']}_{name}.png")


def test_a_foreign_file_is_fitted_right(page: Any, session: Session, foreign: Path) -> None:
    page.set_default_timeout(PATIENT)
    hand = Clicks(page)
    hand.upload(foreign, "Open my recordings")
    sees(page, "All required signals are assigned.")
    sees(page, "fit the other channels if they are swapped")
    sees(page, "Empty cells: 6 in enc_1; the longest gap lasts 0.006 s.")
    shot(page, "table")
    hand.press("Read the file")
    sees(page, "bench.csv: 3000 samples at 1000 Hz, 3.00 s.")
    sees(page, "1 to fit, 0 to validate.")
    sees(page, "Now state your rig.")
    shot(page, "rig")
    hand.press("State this rig")
    until(lambda: session.check.is_checked and not session.check.running, PATIENT / 1000)
    shot(page, "check")
    (fit,) = hand.fit(session).fits
    sees(page, "Converged: yes")
    for estimate in (e for e in fit.estimates if e.recording is None):
        assert estimate.value == pytest.approx(TRUE_EI, rel=CLOSE), estimate.name
    columns = session.document.scenario.recordings[0].columns
    assert columns["theta1"].name == "enc_2 [deg]" and columns["theta2"].name == "enc_1 [deg]"


@pytest.mark.long
@pytest.mark.parametrize(
    ("file", "missing"), [("", NOTHING), ("emps.csv", MISSING)], ids=["own", "slide"]
)
def test_a_file_leads_to_a_verdict_in_seven_clicks(
    page: Any, session: Session, foreign: Path, file: str, missing: str
) -> None:
    path = Path(os.environ.get("FLEXGUI_DATA", "")) / file if file else foreign
    if not path.is_file():
        pytest.skip("the real recordings are not here: FLEXGUI_DATA")
    page.set_default_timeout(PATIENT)
    hand = Clicks(page)
    hand.upload(path, "Open my recordings")
    if file:
        hand.press("Slide, force recorded: use it")
    hand.press("Read the file")
    sees(page, "1 to fit, 0 to validate.")
    hand.press("State this rig")
    hand.fit(session)
    hand.press("Diagnose")
    hand.press("Find what is missing")
    until(lambda: session.diagnosis.newest is not None and not session.run.busy, PATIENT / 1000)
    assert session.diagnosis.newest is not None and session.diagnosis.newest.diagnosis is not None
    assert session.diagnosis.newest.diagnosis.verdict == missing
    assert hand.count <= CLICKS


def resonates(page: Any) -> bool:
    """Whether the second chart of the first stage has peaks, and no point that is no number."""
    charts = json.loads(plots(page))[1]
    if len(charts) < 3 or any(None in column for column in charts[1]):
        return False
    frequency, *gains = np.array(charts[1])
    return bool(np.max(gains) > PEAK * np.max(np.array(gains)[:, frequency < LOW]))


@pytest.mark.long
@pytest.mark.parametrize("brought", [False, True], ids=["on a fresh page", "by a file"])
def test_a_torque_rig_has_its_plots(
    page: Any, session: Session, tmp_path: Path, brought: bool
) -> None:
    """Nothing damps its vibrations: at their poles its response has no value."""
    if brought:
        table = pd.read_csv(io.BytesIO(good_csv(session)))
        recorded = tmp_path / "torques.csv"
        table.filter(regex=r"^(t|u\d|theta\d)( |$)").to_csv(recorded, index=False)
        hand = Clicks(page)
        hand.upload(recorded, "Open my recordings")
        hand.press("Torque recorded: use it")
        hand.press("Read the file")
        sees(page, "1 to fit, 0 to validate.")
    else:
        press(page, "Data")
        page.locator("select[data-action=rig]:visible").select_option("Torque recorded")
    until(lambda: session.document.scenario.drive.kind == "torque")
    press(page, "Arm")
    until(lambda: resonates(page))
    shown = session.document.live_model
    assert shown is not None and shown.scenario is session.document.scenario
    assert not session.faults.outdated and not session.message.bad
    shot(page, f"torque_{brought}")


@pytest.mark.long
def test_a_finding_is_shown_and_mended_with_one_click(
    page: Any, session: Session, foreign: Path
) -> None:
    table = pd.read_csv(foreign).rename(columns={new: old for old, new in LABORATORY.items()})
    table[["theta1", "theta2"]] = np.radians(table[["theta1", "theta2"]].interpolate())
    table["z1 [m]"] *= -1.0
    spoilt = foreign.with_name("spoilt.csv")
    table.to_csv(spoilt, index=False)
    page.set_default_timeout(PATIENT)
    hand = Clicks(page)
    hand.press("Data")
    hand.upload(spoilt)
    hand.press("State this rig")
    sees(page, "Wrong sign")
    shot(page, "finding")
    hand.press("Correct z1")
    sees(page, "The check found nothing wrong.")
    sees(page, "In the scenario now:")
    shot(page, "mended")
    assert session.document.scenario.recordings[0].columns["z1"].sign == -1


@pytest.mark.long
def test_nothing_of_the_table_is_cut_off(
    desktop: Desktop, chromium: Any, session: Session, foreign: Path
) -> None:
    """In windows of all sizes, of one file that was brought once."""
    session.show("Data")
    session.recordings.upload(foreign.name, foreign.read_bytes()).result()
    cut = {size: cut_off(desktop, chromium, size) for size in SIZES}
    assert not any(cut.values()), cut


def cut_off(desktop: Desktop, chromium: Any, size: tuple[int, int]) -> list[Any]:
    """What is cut off or overlaps in a window of that size."""
    context = chromium.new_context(viewport={"width": size[0], "height": size[1]})
    context.set_default_timeout(PATIENT)
    page = context.new_page()
    page.goto(desktop.address)
    sees(page, "All required signals are assigned.")
    page.wait_for_timeout(SETTLED)
    shot(page, "fits")
    found = page.evaluate(BOXES)
    page.locator("table.signals").first.scroll_into_view_if_needed()
    shot(page, "rows")
    context.close()
    return list(found)


@pytest.mark.long
def test_another_rig_asks_for_other_signals(page: Any, session: Session) -> None:
    press(page, "Data")
    page.locator('select[data-action="rig"]').select_option("Voltage recorded")
    until(lambda: session.document.scenario.drive.kind == "voltage")
    page.get_by_text("Data sheet of the rig").click()
    page.locator('.sheet input[name="drive.resistances.0"]').wait_for()
    shot(page, "voltage")
    assert session.document.scenario.recordings == ()


@pytest.mark.long
@pytest.mark.parametrize(
    ("stage", "button"),
    [("Arm", "Open my recordings"), ("Data", "Upload a recording or a scenario")],
)
def test_several_files_of_one_choice_share_one_table(
    page: Any, session: Session, foreign: Path, stage: str, button: str
) -> None:
    second = foreign.with_name("second.csv")
    second.write_bytes(foreign.read_bytes())
    page.set_default_timeout(PATIENT)
    hand = Clicks(page)
    hand.press(stage)
    with page.expect_file_chooser() as chooser:
        hand.press(button)
    chooser.value.set_files([foreign, second])
    sees(page, "bench.csv and one more file: All required signals are assigned.")
    page.get_by_text("Uploading").wait_for(state="detached")
    shot(page, "several")
    hand.press("Read the file")
    sees(page, "2 to fit, 0 to validate.")
    assert [spec.file for spec in session.document.scenario.recordings] == [
        "bench.csv",
        "second.csv",
    ]


DROP = """names => {
    const given = new DataTransfer();
    for (const [name, text] of names) given.items.add(new File([text], name));
    const of = {bubbles: true, cancelable: true, dataTransfer: given};
    document.body.dispatchEvent(new DragEvent("drop", of));
}"""


@pytest.mark.long
def test_files_that_are_dropped_on_the_page_are_brought(
    page: Any, session: Session, foreign: Path
) -> None:
    page.set_default_timeout(PATIENT)
    press(page, "Data")
    page.get_by_text("Upload a recording or a scenario").wait_for()
    text = foreign.read_text()
    page.evaluate(DROP, [["a.csv", text], ["b.csv", text]])
    until(
        lambda: (
            session.recordings.waiting is not None and len(session.recordings.waiting.files) == 2
        ),
        PATIENT / 1000,
    )


def asked_for_the_rig(page: Any, foreign: Path) -> Clicks:
    """A person's file is read, and the sheet stands."""
    hand = Clicks(page)
    hand.upload(foreign, "Open my recordings")
    hand.press("Read the file")
    sees(page, "Now state your rig.")
    return hand


SHEET = {"segments.length": "0,7", "segments.mass": "6", "drive.gains": "80"}


@pytest.mark.long
def test_a_rig_is_stated_in_the_sheet_and_a_wrong_entry_stays(
    page: Any, session: Session, foreign: Path
) -> None:
    hand = asked_for_the_rig(page, foreign)
    for name, text in SHEET.items():
        page.locator(f'.sheet input[name="{name}.0"]').fill(text)
    page.locator('.sheet input[name="segments.mass.1"]').fill("heavy")
    hand.press("State this rig")
    sees(page, "Mass of link 2: 'heavy' is not a number.")
    assert page.locator('.sheet input[name="segments.length.0"]').input_value() == "0,7"
    page.locator('.sheet input[name="segments.mass.1"]').fill("2.5")
    page.keyboard.press("Enter")
    sees(page, "The rig is stated: 0.7 m, 0.5 m.")
    arm = build_arm(session.document.scenario.arm)
    assert [s.mass for s in arm.segments] == [6.0, 2.5]
    assert session.document.scenario.title == "bench"


@pytest.mark.long
def test_what_is_typed_in_the_sheet_survives_another_file(
    page: Any, session: Session, foreign: Path
) -> None:
    asked_for_the_rig(page, foreign)
    field = page.locator('.sheet input[name="segments.length.0"]')
    field.fill("0.7")
    assert session.document.change(set_value(("identify", "seed"), 5)), "it is redrawn"
    assert session.document.change(set_value(("sensors", "camera_noise"), 1e-4))
    page.wait_for_function(
        """document.querySelector('.sheet input[name="sensors.camera_noise.0"]').value === "0.1" """
    )
    assert field.input_value() == "0.7"
