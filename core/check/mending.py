"""What a finding's line of TOML does to the columns of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from core.units import parse_header

Entry = dict[str, Any]

EVEN = 'resample = { how = "interpolate" }'
"""Mends what is wrong with the clock alone; where the rows were taken evenly and only the stamps
scatter, `count` is right, which nobody can see in the file."""


def mended_columns(before: Mapping[str, Any], line: Mapping[str, Any]) -> dict[str, Any]:
    """`columns` of a recording with those of a line on top.

    A column of the file keeps its unit, gain and sign, whichever channel it goes to; what the line
    says of them multiplies them, since the check saw the channel with them.
    """
    entries = {c: _entry(entry) for c, entry in before.items()}
    of_header = {parse_header(entry["name"])[0]: entry for entry in entries.values()}
    after = dict(before)
    for channel, value in line.items():
        said = _entry(value)
        known = of_header.get(parse_header(said["name"])[0], {"name": said["name"]})
        name = said["name"] if parse_header(said["name"])[1] else known["name"]
        factors = {
            key: known.get(key, 1) * said.get(key, 1)
            for key in ("gain", "sign")
            if key in known or key in said
        }
        after[channel] = {"name": name, **factors}
    return after


def _entry(value: Any) -> Entry:
    return {"name": value} if isinstance(value, str) else dict(value)
