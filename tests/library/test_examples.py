"""The examples run, from a folder that is not the repository, and from a wheel."""

from __future__ import annotations

import ast
import json
import os
import runpy
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from flexgui.library.shipped import shipped_folder

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "docs" / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))

WRITES = {"01": "valley.html", "02": "report/report.html", "03": "diagnosed.toml"}
"""Number of an example -> a file that it leaves behind."""


def script_of(notebook: Path) -> str:
    """The cells as a script; what a cell ends with is shown as a notebook shows it."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    lines = ["def show(x): return getattr(x, '_repr_html_', x.__repr__)()"]
    for cell in cells:
        if cell["cell_type"] != "code":
            continue
        tree = ast.parse("".join(cell["source"]))
        end = tree.body[-1]
        if isinstance(end, ast.Expr):
            end.value = ast.Call(ast.Name("show", ast.Load()), [end.value], [])
        lines.append(ast.unparse(ast.fix_missing_locations(tree)))
    return "\n".join(lines)


def test_there_are_five_and_one_is_a_notebook() -> None:
    assert [p.name[:2] for p in sorted([*SCRIPTS, *NOTEBOOKS])] == ["01", "02", "03", "04", "05"]
    assert len(NOTEBOOKS) == 1


@pytest.mark.parametrize("path", [*SCRIPTS, *NOTEBOOKS], ids=lambda p: p.stem)
def test_an_example_says_what_one_learns(path: Path) -> None:
    assert "What you learn" in path.read_text(encoding="utf-8")


SLOW = ("03", "04")
"""Examples that diagnose."""


def marked(path: Path) -> object:
    marks = [pytest.mark.long] if path.name[:2] in SLOW else []
    return pytest.param(path, id=path.stem, marks=marks)


@pytest.mark.parametrize("path", [marked(path) for path in SCRIPTS])
def test_a_script_runs_in_another_folder(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    made = WRITES.get(path.name[:2])
    assert made is None or (tmp_path / made).stat().st_size > 1000


@pytest.mark.parametrize("with_control", [True, False])
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs_in_another_folder(
    path: Path, with_control: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if with_control:
        pytest.importorskip("control", reason="python-control is not installed")
    else:
        monkeypatch.setitem(sys.modules, "control", None)
    monkeypatch.chdir(tmp_path)
    script = tmp_path / "notebook.py"
    script.write_text(script_of(path), encoding="utf-8")
    assert ("system" in runpy.run_path(str(script))) is with_control


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_is_kept_without_outputs(path: Path) -> None:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    assert not any(c.get("outputs") or c.get("execution_count") for c in cells)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an empty environment with the wheel of this checkout and nothing else."""
    home = tmp_path_factory.mktemp("wheel")
    tracked = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, check=True, capture_output=True, text=True,
    ).stdout.splitlines()  # fmt: skip
    for name in tracked:
        target = home / "source" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).exists():
            shutil.copy2(ROOT / name, target, follow_symlinks=False)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    subprocess.run([*pip, "wheel", "--no-deps", "-w", home, home / "source"], check=True)
    wheel = next(home.glob("*.whl"))
    shutil.rmtree(home / "source")
    subprocess.run([sys.executable, "-m", "venv", home / "empty"], check=True)
    python = home / "empty" / ("Scripts" if os.name == "nt" else "bin") / "python"
    limits = ROOT / "constraints.txt"
    install = [python, "-m", "pip", "--quiet", "install", "--constraint", limits]
    subprocess.run([*install, f"{wheel}[control]"], check=True)
    return python


@pytest.mark.long
@pytest.mark.parametrize("path", [*SCRIPTS, *NOTEBOOKS], ids=lambda p: p.stem)
def test_an_example_runs_from_a_wheel(path: Path, installed: Path, tmp_path: Path) -> None:
    script = tmp_path / "example.py"
    text = path.read_text(encoding="utf-8")
    script.write_text(script_of(path) if path in NOTEBOOKS else text, encoding="utf-8")
    subprocess.run([installed, script.name], cwd=tmp_path, check=True)


@pytest.mark.parametrize("name", ["examples", "teaching"])
def test_examples_and_sheets_lie_in_the_package(name: str) -> None:
    packed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = packed["tool"]["setuptools"]["package-data"]["flexgui"]
    here = {p for p in (ROOT / "docs" / name).iterdir() if p.is_file()}
    package = ROOT / "flexgui"
    taken = {p.resolve() for each in patterns for p in package.glob(each)}
    assert here and here <= taken
    assert shipped_folder(name).resolve() == ROOT / "docs" / name


@pytest.mark.long
def test_scenarios_ship_in_the_wheel(installed: Path, tmp_path: Path) -> None:
    ask = "import flexgui as fg; print(flexgui_file(fg)); print(*fg.scenarios())"
    code = f"def flexgui_file(m): return m.__file__\n{ask}"
    told = subprocess.run(
        [installed, "-c", code], cwd=tmp_path, check=True, capture_output=True, text=True
    ).stdout.splitlines()
    assert str(ROOT) not in told[0]
    here = {p.relative_to(ROOT / "scenarios") for p in (ROOT / "scenarios").rglob("*.toml")}
    shipped = {p.with_suffix("").as_posix() for p in here if p.stem != "truth"}
    assert set(told[1].split()) == shipped
    listed = subprocess.run(
        [installed, "-m", "flexgui", "scenarios"], cwd=tmp_path, check=True, capture_output=True,
        text=True,
    ).stdout  # fmt: skip
    folders = [
        Path(line.split(" are in ")[1]) for line in listed.splitlines() if " are in " in line
    ]
    assert [(folder.name, any(folder.iterdir())) for folder in folders] == [
        ("examples", True), ("teaching", True),
    ]  # fmt: skip
    out = tmp_path / "out"
    command = ["-m", "flexgui", "export", "mujoco/nothing", "--out", out, "--quiet"]
    subprocess.run([installed, *command], cwd=tmp_path, check=True)
    assert (out / "report.html").is_file()
