"""The wheel in an empty environment, with what it says it needs and nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.library.test_examples import NOTEBOOKS, SCRIPTS, script_of
from tests.packaging.test_wheel import SCENARIO

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]


def environment(folder: Path, requirement: str) -> Path:
    """The Python of a new environment with this and nothing else."""
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    python = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    install = ["-m", "pip", "--quiet", "install", "--constraint", ROOT / "constraints.txt"]
    subprocess.run([python, *install, requirement], check=True)
    return python


@pytest.fixture(scope="module")
def library(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Without the page."""
    return environment(tmp_path_factory.mktemp("library"), f"{wheel}[control]")


@pytest.fixture(scope="module")
def page(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the page."""
    return environment(tmp_path_factory.mktemp("page"), f"{wheel}[page]")


def said(python: Path, folder: Path, *arguments: str | Path) -> str:
    """What one command prints."""
    return subprocess.run(
        [python, *arguments], cwd=folder, check=True, capture_output=True, text=True
    ).stdout


@pytest.mark.parametrize("path", [*SCRIPTS, *NOTEBOOKS], ids=lambda p: p.stem)
def test_an_example_runs(path: Path, library: Path, elsewhere: Path) -> None:
    script = elsewhere / "example.py"
    text = path.read_text(encoding="utf-8")
    script.write_text(script_of(path) if path in NOTEBOOKS else text, encoding="utf-8")
    said(library, elsewhere, script.name)


def test_scenarios_are_listed_and_run(library: Path, elsewhere: Path) -> None:
    here = {p.relative_to(ROOT / "scenarios") for p in (ROOT / "scenarios").rglob("*.toml")}
    shipped = {p.with_suffix("").as_posix() for p in here if p.stem != "truth"}
    code = "import flexgui as fg; print(*fg.scenarios())"
    assert set(said(library, elsewhere, "-c", code).split()) == shipped
    command = ["-m", "flexgui", "export", "mujoco/nothing", "--out", "out", "--quiet"]
    said(library, elsewhere, *command)
    assert "viser is missing" in (elsewhere / "out" / "report.html").read_text(encoding="utf-8")


def test_nothing_but_flexgui_is_added(library: Path, elsewhere: Path) -> None:
    code = "import sysconfig; print(sysconfig.get_paths()['purelib'])"
    site = Path(said(library, elsewhere, "-c", code).strip())
    assert not [name for name in ("core", "tests", "scenarios") if (site / name).exists()]


def test_a_report_holds_the_motion_with_the_page(page: Path, elsewhere: Path) -> None:
    (elsewhere / "rig.toml").write_text(SCENARIO, encoding="utf-8")
    said(page, elsewhere, "-m", "flexgui", "export", "rig.toml", "--out", "out", "--quiet")
    assert "<iframe" in (elsewhere / "out" / "report.html").read_text(encoding="utf-8")
