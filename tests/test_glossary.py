"""Names, from files to variables, are in the terms of docs/glossary.md."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
GLOSSARY = ROOT / "docs" / "glossary.md"
ROW = re.compile(r"^\| (?P<term>[^|]+) \| [^|]+ \|(?P<retired>[^|]*)\|$", re.MULTILINE)
PART = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")

ONLY_ALONE = {"give"}
"""Retired as a whole name (for a compliance); give_up and give_again are verbs."""

OTHER_MEANINGS = {
    "slot": "core/arm/",
    "slots": "core/arm/",
    "listener": "flexgui/server/",
    "sealed": "flexgui/stages/challenge/state.py",
}
"""Word -> where it means something else, or has to stay: a slot is the index of a number in an
arm's vector, a listener a socket that waits for connections, and a challenge's `sealed` is the name
of a field in the stored work of sessions."""


@cache
def retired() -> dict[str, str]:
    """Retired word -> the term that stands for it."""
    rows = ROW.finditer(GLOSSARY.read_text(encoding="utf-8"))
    return {
        word.strip(): row["term"].strip()
        for row in rows
        for word in row["retired"].split(",")
        if word.strip() and set(word) != {"-", " "} and row["term"].strip() != "Term"
    }


def names(path: Path, source: str) -> Iterator[str]:
    """The file's name and those of all that it defines: classes, functions, their arguments,
    fields, attributes and variables."""
    yield path.stem
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.ClassDef(name=name) | ast.FunctionDef(name=name):
                yield name
            case ast.AsyncFunctionDef(name=name) | ast.arg(arg=name):
                yield name
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                yield name


def faults(path: Path, source: str) -> set[str]:
    """`file:name` of each name that has a retired word in it."""
    return {
        f"{path.as_posix()}:{name}"
        for name in names(path, source)
        for part in PART.findall(name)
        if part.lower() in retired() and not _means_something_else(part.lower(), name, path)
    }


def _means_something_else(word: str, name: str, path: Path) -> bool:
    elsewhere = word in OTHER_MEANINGS and path.as_posix().startswith(OTHER_MEANINGS[word])
    return elsewhere or (word in ONLY_ALONE and name != word)


def found() -> set[str]:
    return {
        fault
        for package in ("core", "flexgui")
        for path in sorted((ROOT / package).rglob("*.py"))
        for fault in faults(path.relative_to(ROOT), path.read_text(encoding="utf-8"))
    }


def test_no_name_has_a_retired_word() -> None:
    assert not (new := found()), "\n".join(
        f"{each}: see docs/{GLOSSARY.name}" for each in sorted(new)
    )


def test_terms_stand_once_and_in_order() -> None:
    rows = ROW.finditer(GLOSSARY.read_text(encoding="utf-8"))
    terms = [t for row in rows if (t := row["term"].strip()) != "Term" and set(t) != {"-"}]
    assert terms == sorted(set(terms), key=str.lower)


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("class Knob: ...", "Knob"),
        ("class OwnKnobSpec: ...", "OwnKnobSpec"),
        ("def f():\n    def told(event): ...", "told"),
        ("def give(): ...", "give"),
        ("def f(room): ...", "room"),
        ("def f(*, on_rival=None): ...", "on_rival"),
        ("class Budget:\n    room: float", "room"),
        ("said = [1]", "said"),
        ("first, *told = 1, 2", "told"),
        ("for knob in range(2): ...", "knob"),
        ("if fall := 1: ...", "fall"),
        ("class A:\n    def f(self):\n        self._desk = 1", "_desk"),
    ],
)
def test_a_retired_word_is_seen_in_each_kind_of_name(source: str, name: str) -> None:
    assert faults(Path("core/x.py"), source) == {f"core/x.py:{name}"}


def test_words_with_another_meaning_are_let_through() -> None:
    assert not faults(Path("core/x.py"), "def give_up(): ...\ndef classroom(): ...")
    assert not faults(Path("core/arm/x.py"), "def base_slot(): ...")
    assert faults(Path("flexgui/x.py"), "def base_slot(): ...")
    assert not faults(Path("core/x.py"), "x.reshape(2)\nprint(packed.tell())")
