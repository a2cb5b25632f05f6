"""From recordings to downloads, with real clicks."""

from __future__ import annotations

import json
import re
import tomllib
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from flexgui.session.session import Session
from tests.page.helpers import enter, field, labelled, plots, press, sees, small
from tests.session.helpers import good_csv, until, worked


@pytest.fixture
def good(session: Session, tmp_path: Path) -> Path:
    """A recording of the session's own arm."""
    path = tmp_path / "good.csv"
    path.write_bytes(good_csv(session))
    return path


def bad_files(good: Path) -> dict[Path, str]:
    """Four files and what their sentence has to name."""
    text = good.read_text()
    lines = text.splitlines()
    cases = {
        "empty": ("", "is empty"),
        "timeless": ("\n".join(line.split(",", 1)[1] for line in lines), "column t"),
        "heavy": (text.replace("z1 [m]", "z1 [kg]", 1), "kg"),
        "long": (text + " " * 1_000_000, "MB"),
    }
    found = {}
    for name, (content, said) in cases.items():
        path = good.with_name(f"{name}.csv")
        path.write_text(content)
        found[path] = said
    return found


def give(page: Any, path: Path) -> None:
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Upload a recording or a scenario").click()
    chooser.value.set_files(path)


@pytest.mark.long
def test_good_and_bad_recordings(page: Any, session: Session, good: Path) -> None:
    worked(session)
    press(page, "Data")
    before = session.document.scenario
    for path, said in bad_files(good).items():
        give(page, path)
        message = page.locator(".fx .bad", has_text=path.stem).first
        message.wait_for()
        assert said in message.inner_text()
        assert session.document.scenario == before
    give(page, good)
    sees(page, "good.csv: 3000 samples at 1000 Hz, 3.00 s.")
    sees(page, "Use it alone, or add it to the 8 present recordings?")
    sees(page, "7 to fit, 1 to validate.")
    press(page, "Add to the 8 present recordings")
    sees(page, "8 to fit, 1 to validate.")


@pytest.mark.long
def test_experiments_are_simulated_as_asked(page: Any, session: Session) -> None:
    press(page, "Data")
    enter(page, "Points", "3")
    page.wait_for_timeout(300)
    press(page, "Simulate these experiments")
    sees(page, "3 to fit, 1 to validate.")
    sees(page, "θ2 = 4π/8")


def test_from_the_button_to_the_files(page: Any, session: Session, tmp_path: Path) -> None:
    small(session)
    press(page, "Identify")
    press(page, "Start identification")
    sees(page, "The data do not determine ε and d separately")
    sees(page, "EI (follows)")
    sees(page, "The paper's table beside ours")
    until(lambda: "population" in plots(page))
    press(page, "Next: compare model and measurements")
    sees(page, "Tip error: ")
    until(lambda: "residual" in plots(page))
    session.playback.move(recording="sweep")
    sees(page, "Recording sweep, validation")
    press(page, "Export")
    download(page, tmp_path, (("Scenario file", ".toml"), ("Report (HTML)", ".html"),
                              ("Model (.json)", ".json")))  # fmt: skip
    assert "E_terms" in json.loads((tmp_path / "Seven_working_points_model.json").read_text())
    scenario = tmp_path / "Seven_working_points.toml"
    assert len(tomllib.loads(scenario.read_text())["recordings"]) == 3


@pytest.mark.long
def test_every_kind_of_file_is_downloaded(page: Any, session: Session, tmp_path: Path) -> None:
    small(session)
    press(page, "Identify")
    press(page, "Start identification")
    sees(page, "EI (follows)")
    press(page, "Export")
    download(page, tmp_path, (
        ("All tables (zip)", ".zip"), ("Model for MATLAB (.mat)", ".mat"),
        ("Model in C (.zip)", ".zip"), ("Linear C code (.zip)", ".zip"),
        ("Model as FMU 3.0 (.fmu)", ".fmu"),
        ("Arm for MuJoCo (.xml)", ".xml"), ("Model for python-control (.py)", ".py"),
        ("3-D playback (HTML)", ".html"),
    ))  # fmt: skip


def download(page: Any, folder: Path, files: Sequence[tuple[str, str]]) -> None:
    """Presses each button and keeps the file that comes, which has the ending beside it."""
    for name, ending in files:
        with page.expect_download() as coming:
            press(page, name)
        path = folder / coming.value.suggested_filename
        coming.value.save_as(path)
        assert path.suffix == ending and path.stat().st_size > 100


@pytest.mark.long
def test_columns_with_other_names_are_chosen_on_the_page(
    page: Any, session: Session, good: Path
) -> None:
    text = good.read_text()
    foreign = good.with_name("foreign.csv")
    foreign.write_text(text.replace("t [s]", "clock", 1).replace("dtheta1_ref", "speed", 1))
    worked(session)
    press(page, "Data")
    give(page, foreign)
    sees(page, "Signals still missing: 1.")  # the clock is known by its rising numbers
    sees(page, "Which column is the joint velocity reference")
    pick(page, "Column", "speed")
    press(page, "Use this column")
    sees(page, "All required signals are assigned.")
    assert not page.locator(".fx .bad").count()
    press(page, "Read the file")
    sees(page, "foreign.csv: 3000 samples at 1000 Hz, 3.00 s.")
    press(page, "Use it alone")
    sees(page, "1 to fit, 0 to validate.")
    columns = session.document.scenario.recordings[-1].columns
    assert {c: s.name.split(" ")[0] for c, s in columns.items()} == {
        "t": "clock", "dtheta1_ref": "speed",
    }  # fmt: skip
    press(page, "Back to it")
    sees(page, "7 to fit, 1 to validate.")


def pick(page: Any, label: str, option: str) -> None:
    """An option of a drop-down, by how it begins."""
    labelled(page, label).click()
    page.get_by_role("option").filter(has_text=re.compile(f"^{option}")).first.click()


@pytest.mark.long
def test_stop_in_mid_run_keeps_the_last_result(page: Any, session: Session) -> None:
    small(session)
    press(page, "Identify")
    press(page, "Start identification")
    sees(page, "EI (follows)")
    complete = session.identification.outcome
    session.document.change(lambda d: d["identify"].update(generations=10_000, population=200))
    press(page, "Start identification")
    sees(page, "Best so far")
    press(page, "Pause")
    sees(page, "Paused")
    press(page, "Go on")
    press(page, "Stop")
    sees(page, "Stopped; the last complete result is kept.")
    sees(page, "EI (follows)")
    assert session.identification.outcome is complete


@pytest.mark.long
def test_the_cursor_moves_arm_and_plots(page: Any, session: Session) -> None:
    press(page, "Data")
    page.wait_for_function("document.querySelectorAll('.js-plotly-plot').length >= 1")
    press(page, "Play")
    page.wait_for_function(
        "parseFloat(document.querySelector('.fx-at.cursor')?.style.left ?? '0') > 100"
    )
    press(page, "Pause")
    until(lambda: not session.playback.cursor.playing)
    stands = 0.3  # wherever it was paused, at the end too, after which it starts again
    session.playback.move(time=stands)
    page.get_by_role("slider", name="Time").press("ArrowRight")
    until(lambda: session.playback.cursor.time > stands)


@pytest.mark.long
def test_texts_of_a_file_are_shown_and_not_run(page: Any, session: Session) -> None:
    evil = "<img src=x onerror='window.evil=1'>"
    session.document.change(lambda d: d.update(title=evil))
    session.document.change(lambda d: d["recordings"][0].update(name=evil))
    session.show_message(evil, bad=True)
    sees(page, "onerror")
    press(page, "Data")
    page.wait_for_timeout(1000)
    assert page.evaluate("window.evil") is None


@pytest.mark.long
def test_the_next_experiment_is_planned_and_taken_away(
    page: Any, session: Session, tmp_path: Path
) -> None:
    small(session)
    press(page, "Export")
    page.get_by_text("Next experiment", exact=True).click()
    enter(page, "Time (s)", "4")
    field(page, "Speed limits").fill("fast")
    press(page, "Plan and download (zip)")
    sees(page, "Speed limits: write one number per joint, separated by commas")
    field(page, "Speed limits").fill("0.3, 0.5")
    with page.expect_download() as download:
        press(page, "Plan and download (zip)")
    download.value.save_as(tmp_path / "next.zip")
    sees(page, "Expected standard deviations, before and after")
    sees(page, "Next experiment: references to play")
    with zipfile.ZipFile(tmp_path / "next.zip") as files:
        assert {"play1.csv", "expected1.csv", "plan.txt", "planned.toml"} <= set(files.namelist())
