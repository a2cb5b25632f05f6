"""What the wheel installs runs without the repository, and without what only the page needs."""

from __future__ import annotations

import os
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from tests.server.served import served, widget

ROOT = Path(__file__).resolve().parents[2]

SECONDS = 20.0
"""A server that has told its address answers; it may still be importing."""

SCENARIO = """
title = "Two points"
[arm]
preset = "paper"
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]
[model]
level = "lpv"
[identify]
parameters = ["EI1"]
start = { EI1 = 600.0 }
[[recordings]]
name = "one"
simulate = { theta2 = 1.2, seconds = 0.3, seed = 1 }
[[recordings]]
name = "other"
role = "validate"
simulate = { theta2 = 2.0, seconds = 0.3, seed = 2 }
"""

WITHOUT_PAGE = """
import sys
sys.modules.update(dict.fromkeys(["segno", "viser", "websockets"]))
"""
"""As if they were not installed."""

SCRIPT = """
import flexgui as fg
print(fg.__file__)
print(fg.load("paper_local").simulate(theta2=1.2, seconds=0.2))
"""

LIBRARY = """
import flexgui as fg
rig = fg.load("rig.toml")
rig.simulate(theta2=1.2, seconds=0.2)
rig.identify()
rig.diagnose().export("library")
"""

COMMANDS = """
from flexgui.cli import run
assert run(["export", "rig.toml", "--out", "command", "--quiet"]) == 0
sys.exit(run(["serve"]))
"""


def run(unpacked: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python in `folder`, with the wheel in front of whatever else is installed."""
    return subprocess.run(
        [sys.executable, *arguments], cwd=folder, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(unpacked)},
    )  # fmt: skip


def test_nothing_but_flexgui_is_installed(unpacked: Path) -> None:
    found = {path.name for path in unpacked.iterdir()}
    assert {name for name in found if not name.endswith(".dist-info")} == {"flexgui"}
    assert not [path for path in unpacked.rglob("*") if path.is_symlink()]


@pytest.mark.long
def test_script_and_command_beside_packages_of_our_names_find_ours(
    unpacked: Path, elsewhere: Path
) -> None:
    (elsewhere / "script.py").write_text(SCRIPT)
    done = run(unpacked, elsewhere, "script.py")
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.splitlines()[0]).is_relative_to(unpacked)
    done = run(unpacked, elsewhere, "-m", "flexgui", "scenarios")
    assert "mujoco/nothing" in done.stdout
    assert str(unpacked / "flexgui" / "examples") in done.stdout


def test_the_page_of_the_wheel_answers(unpacked: Path, elsewhere: Path) -> None:
    with served(elsewhere, nice=True, cwd=elsewhere, PYTHONPATH=str(unpacked)) as server:
        with urllib.request.urlopen(server.address, timeout=SECONDS) as answer:
            assert answer.status == 200 and b"<html" in answer.read()
        with server.browser() as browser:
            widget(browser, "Upload a recording or a scenario")
        assert "Traceback" not in server.log


@pytest.mark.long
def test_library_and_command_line_need_nothing_of_the_page(unpacked: Path, elsewhere: Path) -> None:
    (elsewhere / "rig.toml").write_text(SCENARIO)
    done = run(unpacked, elsewhere, "-c", WITHOUT_PAGE + LIBRARY + COMMANDS)
    assert "needs viser, websockets, segno; run " in done.stderr
    assert done.returncode == 2, done.stderr
    for folder in ("library", "command"):
        assert "3-D motion is left out" in (elsewhere / folder / "report.html").read_text()


@pytest.mark.parametrize("name", ["examples", "teaching"])
def test_examples_and_sheets_lie_in_the_wheel(unpacked: Path, name: str) -> None:
    here = {path.name for path in (ROOT / "docs" / name).iterdir() if path.is_file()}
    assert here and here == {path.name for path in (unpacked / "flexgui" / name).iterdir()}
