"""`flexgui check`: findings as sentences and as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from flexgui.cli import app
from tests.cli.helpers import COLUMNS, FILE, SCENARIO, TEXT, csv, table
from tests.recording.lab_formats import FORMATS

KEYS = {"fault", "recording", "channel", "size", "unit", "evidence", "mend"}


def checked(*arguments: str, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["check", *arguments, "--quiet"])
    assert result.exit_code == code, result.output
    return result.output


def in_millimetres() -> str:
    lines = table()
    k = COLUMNS.index("z1")
    return csv([lines[0], *([*r[:k], f"{1e3 * float(r[k]):.9g}", *r[k + 1 :]] for r in lines[1:])])


@pytest.fixture
def spoilt(tmp_path: Path) -> Path:
    (tmp_path / FILE).write_text(in_millimetres())
    (tmp_path / SCENARIO).write_text(TEXT)
    return tmp_path


def test_a_finding_is_data_with_the_line_of_the_scenario_that_mends_it(spoilt: Path) -> None:
    found = json.loads(checked(str(spoilt / SCENARIO), "--json", code=1))["findings"]
    one = next(f for f in found if f["fault"] == "millimetres")
    assert set(one) == KEYS
    assert (one["recording"], one["channel"], one["mend"]) == (
        "th1", "z1", 'columns = { z1 = { name = "z1 [mm]" } }',
    )  # fmt: skip
    assert one["evidence"].endswith(".")
    mended = TEXT.replace(f'file = "{FILE}"', f'file = "{FILE}"\n{one["mend"]}')
    (spoilt / SCENARIO).write_text(mended)
    assert "millimetres" not in checked(str(spoilt / SCENARIO), "--json")


@pytest.mark.long
def test_an_export_warns_of_a_wrong_unit_above_everything(spoilt: Path) -> None:
    said = CliRunner().invoke(app, ["export", str(spoilt / SCENARIO), "--out", str(spoilt / "out")])
    assert said.exit_code == 0, said.output
    warned = [line for line in said.stdout.splitlines() if line.startswith("Warning: ")]
    assert said.stdout.splitlines()[: len(warned)] == warned
    assert any("tip error" in line.lower() and "arm's length" in line for line in warned)
    assert any("z1: millimetres" in line for line in warned)
    assert said.stdout.splitlines()[-1] == f"The report is {spoilt / 'out' / 'report.html'}."
    report = (spoilt / "out" / "report.html").read_text()
    assert 0 < report.index("millimetres") < report.index('class="summary"')
    notes = json.loads((spoilt / "out" / "result.json").read_text())["notes"]
    assert any("millimetres" in note for note in notes)
    assert "All parameters are identifiable" not in report


def test_good_data_raise_no_alarm(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(csv(table()))
    (tmp_path / SCENARIO).write_text(TEXT)
    assert checked(str(tmp_path / SCENARIO)) == "1 recording, no faults\n"


def test_a_file_by_itself_lists_its_topics_with_their_rates(tmp_path: Path) -> None:
    columns = dict(zip(COLUMNS, np.array(table()[1:], dtype=float).T, strict=True))
    said = checked(str(tmp_path / FORMATS["mcap"](tmp_path, columns)))
    assert "joint_states: 120 samples, 1000 Hz over 0.119 s" in said
    assert "camera/z1" in said and "no faults" in said, "the arm begins at rest"
