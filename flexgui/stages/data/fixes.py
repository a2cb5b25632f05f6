"""How the line of TOML of a finding changes a recording's table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexgui.core.units import parse_header

Entry = dict[str, Any]


def fixed_columns(before: Mapping[str, Any], line: Mapping[str, Any]) -> dict[str, Any]:
    """`columns` of a recording, updated by a line. A column of the file keeps its unit, gain and
    sign for any channel; those of the line multiply them, as the check saw the channel with
    them."""
    entries = {c: _entry(entry) for c, entry in before.items()}
    of_header = {parse_header(entry["name"])[0]: entry for entry in entries.values()}
    after = dict(before)
    for channel, value in line.items():
        stated = _entry(value)
        stated_entry = of_header.get(parse_header(stated["name"])[0], {"name": stated["name"]})
        name = stated["name"] if parse_header(stated["name"])[1] else stated_entry["name"]
        factors = {
            key: stated_entry.get(key, 1) * stated.get(key, 1)
            for key in ("gain", "sign")
            if key in stated_entry or key in stated
        }
        after[channel] = {"name": name, **factors}
    return after


def _entry(value: Any) -> Entry:
    return {"name": value} if isinstance(value, str) else dict(value)
