"""The checks of make lint see what they are for."""

from __future__ import annotations

import ast
from pathlib import Path

from tests.habits.duplicates import LEAST, ROOT, duplicates, shape

LONG = "def {f}({a}):\n    found = []\n" + "".join(
    f"    found.append(({{a}} + {k}) * {k}.5)\n" for k in range(8)
)
"""A function of more than LEAST nodes."""


def function(text: str) -> ast.FunctionDef:
    found = ast.parse(text).body[0]
    assert isinstance(found, ast.FunctionDef)
    return found


def test_names_values_types_and_docstrings_are_no_part_of_a_shape() -> None:
    one = shape(function(LONG.format(f="f", a="x")))
    other = (
        LONG.format(f="g", a="y").replace("0.5", "7.5").replace("(y):", '(y: int):\n    """G."""')
    )
    assert one and one == shape(function(other))


def test_another_operation_is_another_shape() -> None:
    one = LONG.format(f="f", a="x")
    assert shape(function(one)) != shape(function(one.replace("*", "/", 1)))


def test_short_functions_have_none() -> None:
    assert LEAST > 20
    assert not shape(function("def f(x):\n    return x + 1\n"))


def test_a_copy_with_other_names_is_found(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("tests.habits.duplicates.ROOT", tmp_path)
    (tmp_path / "a.py").write_text(LONG.format(f="f", a="x"))
    (tmp_path / "b.py").write_text(LONG.format(f="g", a="y"))
    assert duplicates([tmp_path / "a.py", tmp_path / "b.py"]) == [["a.py:1 f", "b.py:1 g"]]
    assert ROOT.is_dir()
