"""Every scenario that is shipped runs, reports, and gives the same figures again."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from flexgui.cli import app
from flexgui.core.scenario.read import read_scenario

FOLDER = Path(__file__).resolve().parents[2] / "scenarios"
SCENARIOS = sorted(FOLDER.glob("*.toml"))

QUICK = (
    (r"generations = [1-9]\d*", "generations = 4"),
    (r"population = \d+", "population = 8"),
    (r"seconds = [\d.]+", "seconds = 0.5"),
    (r'(?m)^(file = ".*")$', r"\1\nwindow = [0.0, 2.5]"),
    (r"(?s)\n\[\[compare\]\].*", "\n"),
    (r"max_effects = .*", 'max_effects = 1\ncandidates = ["coulomb_friction", "tip_payload"]'),
)
"""What makes a scenario quick and leaves every path through the program as it is."""

STIFFNESS = 520.8333
"""N m²"""

Run = tuple[Path, Path, dict[str, Any]]
"""The scenario as it was run, the folder of the export, and its result."""


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
    assert "Warning: " not in result.output
    assert f"The report is {out / 'report.html'}." in result.output
    return dict(json.loads((out / "result.json").read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path], Run]:
    """A quick scenario and what its first export made, which several tests look at."""

    @cache
    def run(path: Path) -> Run:
        folder = tmp_path_factory.mktemp(path.stem)
        made = quick(path, folder)
        return made, folder / "first", exported(made, folder / "first")

    return run


def check_report(found: dict[str, Any], out: Path, path: Path) -> None:
    """What every result keeps, whatever its numbers are."""
    given = read_scenario(path)
    assert (found["schema"], found["title"]) == (1, given.title)
    assert all(p["identifiable"] is True or p["std"] is None for p in found["parameters"])
    assert found["parameters"] and found["steps"][0]["added"] is None
    errors = [e for step in found["steps"] for e in step["errors"]]
    assert all(e["rms"] >= 0.0 for e in errors)
    most = given.diagnose.max_effects
    assert len([s for s in found["steps"] if s["added"]]) <= most
    asked = [bool(found["verdict"]), bool(found["final_verdict"]), bool(found["ranking"])]
    assert asked == [bool(most)] * 3 and (not most or all(e["floor"] > 0.0 for e in errors))
    assert sorted(found["files"]) == sorted(
        p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file()
    )
    report = (out / "report.html").read_text(encoding="utf-8")
    assert "</html>" in report
    assert not re.search(r'<(script|link|img|iframe)\b[^>]*\b(src|href)="https?:', report)


def per_scenario(*quick: str) -> pytest.MarkDecorator:
    """One test per shipped scenario; all but the `quick` ones belong to the long tests."""
    marks = {path: [] if path.stem in quick else [pytest.mark.long] for path in SCENARIOS}
    return pytest.mark.parametrize(
        "path", [pytest.param(p, id=p.stem, marks=marks[p]) for p in SCENARIOS]
    )


@per_scenario("paper_glocal", "paper_local")
def test_a_scenario_runs_and_reports(path: Path, once: Callable[[Path], Run]) -> None:
    require_files(path)
    made, out, found = once(path)
    check_report(found, out, made)


@per_scenario("paper_local")
def test_a_scenario_runs_twice_to_the_same_result(
    path: Path, once: Callable[[Path], Run], tmp_path: Path
) -> None:
    require_files(path)
    made, _, first = once(path)
    second = exported(made, tmp_path / "second")
    assert set(first["seconds"]) == set(second["seconds"])
    assert {**first, "seconds": None} == {**second, "seconds": None}


@per_scenario()
def test_a_whole_scenario_runs(path: Path, tmp_path: Path) -> None:
    require_files(path)
    check_report(exported(path, tmp_path / "out"), tmp_path / "out", path)


@pytest.mark.parametrize("method", ["glocal", "local"])
def test_the_papers_study_finds_the_product(method: str, once: Callable[[Path], Run]) -> None:
    _, _, found = once(FOLDER / f"paper_{method}.toml")
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


SIZE = 0.02
"""Relative: the friction's size from half a second per recording."""


@pytest.mark.long
def test_the_hidden_friction_is_named_with_its_size(once: Callable[[Path], Run]) -> None:
    _, _, found = once(FOLDER / "hidden_friction.toml")
    assert (found["verdict"], found["final_verdict"]) == ("missing", "nothing_missing")
    assert [s["added"] for s in found["steps"]] == [None, "coulomb_friction"]
    assert found["ranking"][0]["effect"] == "coulomb_friction"
    sizes = {p["name"]: p["value"] for p in found["steps"][1]["parameters"]}
    assert sizes["fc1"] == pytest.approx(1.2, rel=SIZE)
    assert sizes["fc2"] == pytest.approx(0.5, rel=SIZE)
    assert all(e["rms"] < 1.1 * e["floor"] for e in found["steps"][1]["errors"])
