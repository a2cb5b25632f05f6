"""What the test command of a clean checkout sets up."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

RUN = Path(__file__).resolve().parents[1] / ".ci" / "run"
VARIABLE = "FLEXGUI_DATA"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A checkout with the command only, and tools that do nothing but tell."""
    tools, made = tmp_path / "tools", tmp_path / "project" / ".ci"
    tools.mkdir()
    made.mkdir(parents=True)
    shutil.copy(RUN, made / "run")
    for name, text in (("make", f'echo "$1 ${{{VARIABLE}:-none}}"'), ("python3.11", "exit 0")):
        (tools / name).write_text(f"#!/bin/sh\n{text}\n")
        (tools / name).chmod(0o755)
    return tmp_path / "project"


def told(project: Path, **more: str) -> str:
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
    path = f"{project.parent / 'tools'}:{environment['PATH']}"
    found = subprocess.run(
        ["bash", project / ".ci" / "run"], env={**environment, "PATH": path, **more},
        capture_output=True, text=True, check=True, cwd="/",
    )  # fmt: skip
    return found.stdout.strip()


def test_recordings_beside_the_project_are_used(project: Path) -> None:
    assert told(project) == "test none"
    recordings = project.parent / "shared" / "data" / "real"
    recordings.mkdir(parents=True)
    assert told(project) == f"test {recordings.resolve()}"


def test_a_folder_that_somebody_names_wins(project: Path) -> None:
    (project.parent / "shared" / "data" / "real").mkdir(parents=True)
    assert told(project, FLEXGUI_DATA="/elsewhere") == "test /elsewhere"
