"""The words of page, report, command line and errors: the field's terms in plain English."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted(path for name in ("core", "flexgui") for path in (ROOT / name).rglob("*.py"))
TEMPLATES = sorted(
    path for room in ("export", "stages") for path in (ROOT / "flexgui" / room).rglob("*.j2")
)
GLOSSARY = ROOT / "docs" / "glossary.md"
"""Lists retired words beside their terms."""
DOCS = sorted(set((ROOT / "docs").glob("*.md")) - {GLOSSARY})
PAGES = [ROOT / "README.md", *DOCS, *TEMPLATES]

TERMS = {
    r"\b(the|its|their|a) floors?\b": "noise floor",
    r"\b(?<!noise )floors\b": "noise floor",
    r"\bleft over\b|\bleaves over\b": "residual",
    r"\basked for\b": "selected, required",
    r"\bbrought\b|\bbring (your own|back|the)\b": "imported, restore",
    r"\btold\b": "distinguished, reported",
    r"\btell \S+( \S+)? apart\b": "distinguish",
    r"\b(a|the) slope promises\b|\bexpected from the slope\b": "estimate before refitting",
    r"\bfitted anew\b": "refitted",
    r"\bhardly call for\b": "barely excite",
    r"\bmade room for\b": "set aside",
    r"\bno model is asked to explain\b": "a small modelling tolerance",
    r"\bturned round\b": "with the opposite sign",
}
"""What a sentence must not say -> the term that stands for it."""

RETIRED = (
    "That column it is", "Leave it", "Leave them", "Turn its sign", "Asked for", "Leave a stretch",
    "All that it says", "Explains of the error", "Look again", "No tour, thank you", "Begin again",
    "determine every parameter by itself", "Who asks the tool", "asked the tool", "It stood at",
    "What is missing is told", "through: other effects", "Camera late", "Still needed",
)  # fmt: skip
"""Labels and sentences that were replaced."""

FORBIDDEN = {**TERMS, **{rf"{re.escape(text)}\b": "its replacement" for text in RETIRED}}

NO_SENTENCES = {
    "flexgui/export/tables.py": "column names of CSV files",
}
"""Files in which a bare term names a column."""


def sentences(source: str) -> Iterator[tuple[int, str]]:
    """(line, text) of each string with a space that is no docstring; {} stands for a value."""
    tree = ast.parse(source)
    inside = {
        id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)
        for part in node.values
    }  # fmt: skip
    silent = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)} | inside
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield node.lineno, "".join(_piece(part) for part in node.values)
        elif isinstance(node, ast.Constant) and id(node) not in silent and " " in str(node.value):
            yield node.lineno, str(node.value)


def _piece(part: ast.expr) -> str:
    return str(part.value) if isinstance(part, ast.Constant) else "{}"


def faults(text: str) -> list[str]:
    return [
        f"{found.group(0)!r}: say {better}"
        for pattern, better in FORBIDDEN.items()
        if (found := re.search(pattern, " ".join(text.split())))
    ]


def test_no_sentence_of_the_program_uses_a_retired_word() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line} {fault}"
        for path in SOURCES
        if str(path.relative_to(ROOT)) not in NO_SENTENCES
        for line, text in sentences(path.read_text(encoding="utf-8"))
        for fault in faults(text)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_page_of_documentation_or_report_uses_a_retired_word(page: Path) -> None:
    found = faults(page.read_text(encoding="utf-8"))
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "source",
    [
        'x = "What is left over"',
        'x = f"The error is {y:.2f} times its floor."',
        'x = ("No tour, "\n     "thank you")',
        'call(hint="in squared floors")',
    ],
)
def test_a_retired_word_is_seen_in_each_kind_of_string(source: str) -> None:
    assert [fault for _, text in sentences(source) for fault in faults(text)]


@pytest.mark.parametrize(
    "source",
    [
        'def f():\n    """Left over, in floors."""',
        "x = told(left_over)",
        'x = row["floor"]',
        'x = "three times the noise floor, in squared noise floors"',
    ],
)
def test_docstrings_identifiers_and_the_right_term_are_let_through(source: str) -> None:
    assert not [fault for _, text in sentences(source) for fault in faults(text)]
