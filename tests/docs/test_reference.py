"""docs/scenario.md is what the schema says, and the schema says something of every key."""

from __future__ import annotations

from pathlib import Path

from flexgui.core.drives.drive import drive_classes
from flexgui.core.effects import catalogue
from flexgui.core.sensors import sensors
from flexgui.reference import reference_text

ROOT = Path(__file__).resolve().parents[2]
FILE = "docs/scenario.md"
MANY_KEYS = 100
"""Fewer would mean that whole tables are not generated."""


def test_the_reference_is_fresh() -> None:
    kept = (ROOT / FILE).read_text(encoding="utf-8")
    assert kept == reference_text(), f"run: flexgui reference > {FILE}"


def test_every_key_is_explained() -> None:
    keys: list[str] = []
    head = ""
    for line in reference_text().splitlines():
        if line.startswith("| Key |"):
            head = line
        elif not line.startswith("|"):
            head = ""
        elif head and "---" not in line:
            keys.append(line)
    assert len(keys) > MANY_KEYS
    assert not [line for line in keys if line.endswith("|  |")]


def test_the_changelog_counts_the_effects() -> None:
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"- {len(catalogue())} physical effects that a model may lack" in changes


def test_every_plug_in_is_in_it() -> None:
    text = reference_text()
    for kind in (*catalogue(), *drive_classes(), *sensors()):
        assert f"`{kind}`" in text
