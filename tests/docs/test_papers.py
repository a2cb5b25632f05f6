"""What the documents say of the code is so."""

from __future__ import annotations

import importlib
import re
import tomllib
from pathlib import Path

import pytest

import flexgui

ROOT = Path(__file__).resolve().parents[2]
DOCS = sorted((ROOT / "docs").glob("*.md"))
LINK = re.compile(r"\]\(([^)#:]+)\)")
FILE = re.compile(r"`((?:core|flexgui|tests|docs|scenarios)/[\w./-]+\.\w+)`")
THRESHOLD = re.compile(r"^\| `([\w.]+)\.([A-Z_]+)` \| ([\d.]+) \|", re.MULTILINE)


def thresholds() -> list[tuple[str, str, float]]:
    text = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
    return [(module, name, float(value)) for module, name, value in THRESHOLD.findall(text)]


@pytest.mark.parametrize(("module", "name", "value"), thresholds(), ids=lambda x: str(x))
def test_a_threshold_of_the_method_is_that_of_the_code(
    module: str, name: str, value: float
) -> None:
    assert getattr(importlib.import_module(module), name) == value


def test_the_method_lists_its_thresholds() -> None:
    assert len(thresholds()) >= 15


@pytest.mark.parametrize("path", [*DOCS, ROOT / "README.md"], ids=lambda p: p.name)
def test_files_that_a_document_names_are_there(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for name in LINK.findall(text):
        assert (path.parent / name).exists(), name
    for name in FILE.findall(text):
        assert (ROOT / name).exists(), name


def test_the_citation_has_the_version_of_the_package() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {flexgui.__version__}\n" in text
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"license: {project['license']['text']}" in text


def test_the_readme_points_to_the_documents() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for path in (*DOCS, ROOT / "docs" / "examples"):
        assert path.relative_to(ROOT).as_posix() in text
