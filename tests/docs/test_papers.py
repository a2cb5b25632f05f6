"""What the documents say of the code is so."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import flexgui
from tests.programs.docs.numbers import named_numbers, rows, value_of

ROOT = Path(__file__).resolve().parents[2]
DOCS = sorted((ROOT / "docs").rglob("*.md"))
LINK = re.compile(r"\]\(([^)#:]+)\)")
FILE = re.compile(r"`((?:core|flexgui|tests|docs|scenarios)/[\w./-]+\.\w+)`")


def test_every_number_that_decides_is_a_row_of_the_table_with_its_value() -> None:
    table, numbers = rows(), named_numbers()
    missing = [key for key in numbers if key not in table]
    assert not missing, "python -m tests.programs.docs.numbers adds their rows"
    wrong = {
        key: value for key, (value, _) in table.items() if f"{value_of(*key):g}" != f"{value:g}"
    }
    assert not wrong
    assert not [key for key, (_, words) in table.items() if not words.strip()]


@pytest.mark.parametrize(
    "path", [*DOCS, ROOT / "README.md"], ids=lambda p: p.relative_to(ROOT).as_posix()
)
def test_files_that_a_document_names_are_there(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for name in LINK.findall(text):
        assert (path.parent / name).exists(), name
    for name in FILE.findall(text):
        assert (ROOT / name).exists(), name


def test_modules_that_a_document_names_are_there() -> None:
    files = [path.as_posix() for path in ROOT.rglob("*.py") if ".venv" not in path.parts]
    for name in ("method", "architecture", "contributing"):
        text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
        for module in re.findall(r"`([a-z_/]+\.py)`", text):
            assert any(path.endswith(f"/{module}") for path in files), module


def test_the_citation_has_the_version_of_the_package() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {flexgui.__version__}\n" in text
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"license: {project['license']['text']}" in text


def test_every_page_is_in_the_navigation_of_the_site() -> None:
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    listed = re.findall(r": (\S+\.md)$", text, re.MULTILINE)
    assert sorted(listed) == [path.relative_to(ROOT / "docs").as_posix() for path in DOCS]


def test_every_public_name_has_an_entry_in_the_library() -> None:
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    entries = re.findall(r"^::: flexgui\.(\w+)$", text, re.MULTILINE)
    assert sorted(entries) == sorted(set(dir(flexgui)) - {"__version__"})


def test_the_readme_is_short_and_points_to_the_pages() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert text.count("\n") <= 120
    for path in DOCS:
        if path.parent.name != "teaching" and path.name not in ("changelog.md", "scenarios.md"):
            assert path.relative_to(ROOT).as_posix() in text
