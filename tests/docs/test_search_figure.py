"""The figure of the search in docs/method.md is what the code runs."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "core" / "diagnose"
LINE = re.compile(r"^( *)(\w+\.py)\b")


@cache
def figure() -> tuple[tuple[int, str], ...]:
    """(indentation, file) of each line of the figure that names a file."""
    text = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
    block = text.split("## 3. Diagnosis", 1)[1].split("```", 2)[1]
    found = (LINE.match(line) for line in block.splitlines())
    return tuple((len(m[1]), m[2]) for m in found if m)


def drawn() -> dict[str, list[str]]:
    """File -> the files below it that stand one step further right."""
    edges: dict[str, list[str]] = {}
    above: list[tuple[int, str]] = []
    for indent, name in figure():
        above = [(i, n) for i, n in above if i < indent]
        if above:
            edges.setdefault(above[-1][1], []).append(name)
        above.append((indent, name))
    return edges


def called_in(name: str) -> list[str]:
    """Files of the folder whose functions or classes a file uses, in the order of its text."""
    tree = ast.parse((FOLDER / name).read_text(encoding="utf-8"))
    source: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("diagnose."):
            for alias in node.names:
                source[alias.asname or alias.name] = f"{(node.module or '').split('.')[1]}.py"
    calls = [
        (node.lineno, source[node.func.id])
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in source
    ]
    return list(dict.fromkeys(name for _, name in sorted(calls)))


def test_the_figure_draws_files_that_are_there() -> None:
    assert len(figure()) > 10
    assert all((FOLDER / name).is_file() for _, name in figure())


@pytest.mark.parametrize("name", sorted(drawn()))
def test_a_file_calls_those_that_are_drawn_below_it_and_no_others_of_the_figure(name: str) -> None:
    in_figure = {other for _, other in figure()}
    called = [other for other in called_in(name) if other in in_figure and other != name]
    assert set(called) == set(drawn()[name])
