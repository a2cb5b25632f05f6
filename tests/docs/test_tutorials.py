"""Each tutorial can be followed literally, and its commands print the figures that it states."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.workbench.test_real_rigs import data_folder

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
README = ROOT / "README.md"
BLOCK = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?")

RECORDED = {"real_arm": ("rigs/merit1.csv", "rigs/merit2.csv")}
"""Tutorial -> recordings that it needs and that are not shipped."""

NEAR = 2e-3
"""Relative: figures of another machine differ in their last digits."""
NEAR_STD = 0.5
"""Of what stands after ±, which has one digit."""
LONGEST = 400
"""s of one command on a busy machine that compiles everything anew."""


@dataclass(frozen=True)
class Block:
    """A fenced block of a page; `title` names the file that it is to be saved as."""

    language: str
    title: str
    text: str


def blocks(page: Path) -> list[Block]:
    """The blocks of a page, in their order."""
    return [
        Block(language, "".join(re.findall(r'title="([^"]+)"', options)), text)
        for language, options, text in BLOCK.findall(page.read_text(encoding="utf-8"))
    ]


def printed_by(line: str, folder: Path) -> str:
    """All that one command prints; its comment states an exit code other than 0. `flexgui` and
    `python` are those of the test."""
    line, _, comment = line.partition("#")
    name, *arguments = line.split()
    command = {"python": [], "flexgui": ["-m", "flexgui"]}[name]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(
        [sys.executable, *command, *arguments], cwd=folder, env=environment,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8", timeout=LONGEST,
    )  # fmt: skip
    code = re.search(r"exit code (\d)", comment)
    assert done.returncode == (int(code[1]) if code else 0), done.stdout
    return done.stdout


def agrees(stated: str, line: str) -> bool:
    """Whether a printed line holds the stated words and, nearly, the stated numbers."""
    words = [re.escape(part) for part in NUMBER.split(stated)]
    found = re.search(r"(-?\d+(?:\.\d+)?)".join(words), line)
    return found is not None and all(
        float(printed) == pytest.approx(float(number.group()), rel=_near(stated, number.start()))
        for number, printed in zip(NUMBER.finditer(stated), found.groups(), strict=True)
    )


def _near(stated: str, start: int) -> float:
    return NEAR_STD if stated[:start].endswith("± ") else NEAR


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_every_command_is_one_of_python_or_flexgui_and_every_script_is_there(page: Path) -> None:
    files = {block.title for block in blocks(page) if block.title}
    for block in blocks(page):
        if block.language == "sh":
            for name, first, *_ in map(str.split, block.text.splitlines()):
                assert name == "flexgui" or (name == "python" and first in files)


@pytest.mark.long
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_prints_what_it_states(page: Path, tmp_path: Path) -> None:
    data_folder(*RECORDED.get(page.stem, ()))
    printed: list[str] = []
    for block in blocks(page):
        if block.title:
            (tmp_path / block.title).write_text(block.text, encoding="utf-8")
        elif block.language == "sh":
            commands = block.text.splitlines()
            printed = [x for line in commands for x in printed_by(line, tmp_path).splitlines()]
        elif block.language == "text":
            for stated in block.text.splitlines():
                assert any(agrees(stated, line) for line in printed), (stated, printed)


@pytest.mark.long
def test_the_readme_prints_what_it_states(tmp_path: Path) -> None:
    texts = {block.language: block.text for block in blocks(README)}
    (tmp_path / "snippet.py").write_text(texts["python"], encoding="utf-8")
    printed = printed_by("python snippet.py", tmp_path).replace("\xa0", " ").splitlines()
    for stated in texts["text"].splitlines():
        assert any(agrees(stated, line) for line in printed), (stated, printed)
    assert (tmp_path / "reports/friction/report.html").is_file()


NOT_OPENED = """
import plotly.graph_objects as go
go.Figure.show = lambda self: None
"""


@pytest.mark.long
def test_the_code_about_exports_runs_in_its_order(tmp_path: Path) -> None:
    """With the extras that it names; figures are made and not opened."""
    pytest.importorskip("casadi", reason="casadi is an extra")
    pytest.importorskip("fmpy", reason="fmpy is an extra of the tests")
    page = blocks(ROOT / "docs" / "howto" / "exports.md")
    code = "\n".join([NOT_OPENED, *(b.text for b in page if b.language == "python")])
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    run = [sys.executable, "-c", code]
    subprocess.run(run, cwd=tmp_path, env=environment, check=True, timeout=LONGEST)
