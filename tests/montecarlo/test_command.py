"""`flexgui study`: progress, results, going on, and one sentence where something is wrong."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flexgui.cli import app
from tests.montecarlo.helpers import scenario_file, short

PATIENCE = 120.0
"""s until the first result of a process that starts from nothing."""

FITS = ["--runs", "2", "--workers", "1", "--part", "fits"]


@pytest.mark.long
def test_a_study_is_written_and_a_second_call_has_nothing_to_do(tmp_path: Path) -> None:
    scenario, out = scenario_file(tmp_path, short()), tmp_path / "out"
    command = ["study", str(scenario), "--out", str(out), *FITS]
    first = CliRunner().invoke(app, command)
    assert first.exit_code == 0, first.output
    assert "4/4 fits/" in first.output and (out / "study.html").exists()
    journal = (out / "results.jsonl").read_bytes()
    again = CliRunner().invoke(app, command)
    assert "All 4 were finished before." in again.output
    assert (out / "results.jsonl").read_bytes() == journal


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--part", "fit"], "'fits'"),
        (["--workers", "0"], "--workers"),
        (["--runs", "0"], "runs"),
        (["scenarios/emps.toml"], "study"),
    ],
)
def test_a_slip_is_told_in_one_sentence(tmp_path: Path, options: list[str], said: str) -> None:
    if options[0].startswith("--"):
        options = [str(scenario_file(tmp_path, short())), *options]
    found = CliRunner().invoke(app, ["study", *options, "--out", str(tmp_path)])
    assert found.exit_code == 2
    assert said in found.output and "Traceback" not in found.output


@pytest.mark.long
def test_ctrl_c_stops_cleanly_and_says_how_to_go_on(tmp_path: Path) -> None:
    scenario, out = scenario_file(tmp_path, short()), tmp_path / "out"
    command = [sys.executable, "-m", "flexgui", "study", str(scenario), "--out", str(out)]
    process = subprocess.Popen(
        [*command, "--runs", "500", "--part", "fits"],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
    )  # fmt: skip
    journal, until = out / "results.jsonl", time.monotonic() + PATIENCE
    while time.monotonic() < until and not (journal.exists() and journal.stat().st_size > 1000):
        time.sleep(0.2)
    os.killpg(process.pid, signal.SIGINT)
    text, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "to continue; finished cases are kept" in text and "Traceback" not in text
    assert (out / "study.html").exists()
