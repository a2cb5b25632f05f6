"""Every scenario that is shipped runs, reports, and gives the same figures again."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from core.scenario.read import read_scenario
from flexgui.cli import app

FOLDER = Path(__file__).resolve().parents[2] / "scenarios"
SCENARIOS = sorted(FOLDER.glob("*.toml"))

QUICK = (
    (r"generations = [1-9]\d*", "generations = 4"),
    (r"population = \d+", "population = 8"),
    (r"seconds = [\d.]+", "seconds = 0.5"),
    (r'(?m)^(file = ".*")$', r"\1\nwindow = [0.0, 2.5]"),
    (r"(?s)\n\[\[compare\]\].*", "\n"),
)
"""What makes a scenario quick and leaves every path through the program as it is."""

STIFFNESS = 520.8333
"""N m²"""


def needed(path: Path) -> list[str]:
    return [r.file for r in read_scenario(path).recordings if r.file is not None]


def require_files(path: Path) -> None:
    folder = Path(os.environ.get("FLEXGUI_DATA", "no folder named"))
    for file in needed(path):
        if not (folder / file).is_file() and not (FOLDER / file).is_file():
            pytest.skip(f"{path.name} needs the real recording {file}; FLEXGUI_DATA is {folder}")


def quick(path: Path, folder: Path) -> Path:
    text = path.read_text(encoding="utf-8")
    for pattern, new in QUICK:
        text = re.sub(pattern, new, text)
    made = folder / path.name
    made.write_text(text, encoding="utf-8")
    return made


def exported(path: Path, out: Path) -> dict[str, Any]:
    result = CliRunner().invoke(app, ["export", str(path), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert result.output == ""
    return dict(json.loads((out / "result.json").read_text(encoding="utf-8")))


def check_report(found: dict[str, Any], out: Path, path: Path) -> None:
    """The promises of design section 7."""
    assert found["schema"] == 1
    assert found["title"] == read_scenario(path).title
    assert found["parameters"]
    for p in found["parameters"]:
        assert {"name", "value", "std", "unit", "identifiable"} <= p.keys()
        assert p["identifiable"] is True or p["std"] is None
    (step,) = found["steps"]
    assert step["added"] is None
    assert {"tip_rms_m", "fit_percent", "validation_fit_percent", "errors"} <= step.keys()
    assert all(e["rms"] >= 0.0 for e in step["errors"])
    assert found["seconds"]["identify"] > 0.0
    listed = sorted(found["files"])
    assert listed == sorted(p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file())
    report = (out / "report.html").read_text(encoding="utf-8")
    assert "</html>" in report
    assert not re.search(r'<(script|link|img|iframe)\b[^>]*\b(src|href)="https?:', report)


def test_there_are_scenarios_to_run() -> None:
    assert {"paper_glocal.toml", "paper_local.toml"} <= {p.name for p in SCENARIOS}


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_a_scenario_runs_twice_to_the_same_result(path: Path, tmp_path: Path) -> None:
    require_files(path)
    made = quick(path, tmp_path)
    first = exported(made, tmp_path / "first")
    second = exported(made, tmp_path / "second")
    check_report(first, tmp_path / "first", made)
    assert set(first.pop("seconds")) == set(second.pop("seconds"))
    assert first == second


@pytest.mark.long
@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_a_whole_scenario_runs(path: Path, tmp_path: Path) -> None:
    require_files(path)
    check_report(exported(path, tmp_path / "out"), tmp_path / "out", path)


@pytest.mark.parametrize("method", ["glocal", "local"])
def test_the_papers_study_finds_the_product(method: str, tmp_path: Path) -> None:
    found = exported(quick(FOLDER / f"paper_{method}.toml", tmp_path), tmp_path / "out")
    by_name = {p["name"]: p for p in found["parameters"]}
    assert by_name["EI"]["value"] == pytest.approx(STIFFNESS, rel=0.01)
    assert by_name["EI"]["identifiable"] is True
    assert not by_name["epsilon"]["identifiable"]
    assert not by_name["d"]["identifiable"]
    assert len(found["fits"]) == (1 if method == "glocal" else 7)
    assert all("ε d⁴" in f["identifiability"]["sentences"][0] for f in found["fits"])
    roles = [r["role"] for r in found["recordings"]]
    assert roles.count("estimate") == 7
    assert roles.count("validate") == 2
