"""The examples run, from a folder that is not the repository."""

from __future__ import annotations

import ast
import json
import runpy
import sys
from pathlib import Path

import pytest

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


def test_examples_say_what_one_learns_and_are_kept_without_outputs() -> None:
    texts = {p.name[:2]: p.read_text(encoding="utf-8") for p in [*SCRIPTS, *NOTEBOOKS]}
    assert sorted(texts) == ["01", "02", "03", "04", "05"] and len(NOTEBOOKS) == 1
    assert all("What you learn" in text for text in texts.values())
    cells = json.loads(texts["05"])["cells"]
    assert not any(c.get("outputs") or c.get("execution_count") for c in cells)


@pytest.mark.long
@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
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
