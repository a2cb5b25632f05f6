"""From a scenario back to TOML."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from core.files import replacing
from core.scenario.schema import Scenario


def write_scenario(scenario: Scenario, path: Path) -> None:
    """Write a file that `read_scenario` reads back as an equal scenario."""
    with replacing(path) as temporary:
        temporary.write_text(scenario_toml(scenario), encoding="utf-8")


def scenario_toml(scenario: Scenario) -> str:
    """The scenario as TOML: what differs from the defaults, as a person would write it."""
    return document_toml(scenario.model_dump(exclude_defaults=True))


def document_toml(document: Mapping[str, Any]) -> str:
    """A scenario's tables as TOML, tables that are empty too."""
    return _SHORT_LIST.sub(_on_one_line, tomli_w.dumps(_plain(dict(document))))


_SHORT_LIST = re.compile(r"\[\n((?: +[^\n\[\]{}]+,\n)+) *\]")
"""A list of numbers or words as tomli_w writes it, one entry per line."""
_WIDTH = 80


def _on_one_line(found: re.Match[str]) -> str:
    entries = [line.strip() for line in found[1].split("\n") if line]
    line = "[" + " ".join(entries).removesuffix(",") + "]"
    return line if len(line) <= _WIDTH else found[0]


def _plain(value: Any) -> Any:
    """Without tuples and without None, which TOML lacks."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return value
