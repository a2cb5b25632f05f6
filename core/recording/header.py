"""What stands above the samples of a text table, and how its cells are separated."""

from __future__ import annotations

import csv
from typing import NamedTuple

from ..errors import InputError
from ..recording.channels import is_channel
from ..recording.table import check_distinct, is_number
from ..units import is_unit, parse_header

DELIMITERS = ",;\t"
COMMA_DECIMALS = ";\t"
"""Between these delimiters a comma stands for the decimal point."""
MOST_LINES = 300
"""Above the samples; the longest headers of drives' scopes have a few dozen."""
COMMENT = "#%/!"
"""With one of these begins a line that programs write above their tables."""


class Heading(NamedTuple):
    """What stands above the samples."""

    names: list[str]
    """With their units, `theta1 [deg]`."""
    delimiter: str
    first_line: int
    """Of the file, with data row 1."""
    body: int
    """Byte at which the samples begin."""

    @property
    def comma(self) -> bool:
        """Whether a comma may stand for the decimal point."""
        return self.delimiter in COMMA_DECIMALS


def read_heading(file: str, block: bytes) -> Heading:
    """The heading of a table whose first bytes are `block`; InputError where it has none."""
    raw = block.splitlines(keepends=True)[:MOST_LINES]
    lines = [decoded(line).rstrip("\r\n") for line in raw]
    used = [k for k, line in enumerate(lines) if line.strip()]
    delimiter, width = _delimiter(lines)
    data = next((k for k in used if width and _sample_width(lines[k], delimiter) == width), None)
    top = _header_line(lines, used, data, delimiter, width)
    if not width:
        delimiter = max(DELIMITERS, key=lines[top].count)
    cells = _names(lines[top], delimiter)
    below = top + 1
    units: list[str] = []
    if below < len(lines) and below != data:
        units = _units(lines[below], delimiter, len(cells))
        below += bool(units)
    names = _with_units(file, cells, units)
    return Heading(names, delimiter, below + 1, sum(map(len, raw[:below])))


def decoded(raw: bytes) -> str:
    """A text in UTF-8, or as older programs write the degree sign, which never fails."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def cells_of(text: str, delimiter: str) -> list[str]:
    """The cells of a line; none where it is blank."""
    if '"' not in text:
        return [cell.strip() for cell in text.split(delimiter)] if text.strip() else []
    try:
        return [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter), [])]
    except csv.Error:
        return []


def _names(text: str, delimiter: str) -> list[str]:
    """Cells of a header line, which may stand in a comment."""
    return cells_of(text.lstrip(COMMENT + " "), delimiter)


def _delimiter(lines: list[str]) -> tuple[str, int]:
    """The one that cuts most lines into equally many numbers, and how many; width 0: none."""
    best, chosen = (0, 0), (DELIMITERS[0], 0)
    for delimiter in DELIMITERS:
        widths = [_sample_width(line, delimiter) for line in lines]
        for width in {w for w in widths if w > 1}:
            if (score := (widths.count(width), width)) > best:
                best, chosen = score, (delimiter, width)
    return chosen


def _sample_width(text: str, delimiter: str) -> int:
    """Cells of a line most of which are numbers; 0 of another line."""
    cells = cells_of(text, delimiter)
    full = [cell for cell in cells if cell]
    numbers = sum(is_number(cell, delimiter in COMMA_DECIMALS) for cell in full)
    return len(cells) if full and 2 * numbers > len(full) else 0


def _header_line(
    lines: list[str], used: list[int], data: int | None, delimiter: str, width: int
) -> int:
    """Of the lines above the samples as wide as they are, that with most channels; the last one
    that is no row of units where none has any. Else the first line with text."""
    first = next((k for k in used if lines[k].strip()[0] not in COMMENT), used[0])
    fitting = [
        k for k in used if (data is None or k < data) and len(_names(lines[k], delimiter)) == width
    ]
    if data is None or not fitting:
        return first
    channels = {k: _channels(lines[k], delimiter) for k in fitting}
    most = max(channels.values())
    if most:
        return next(k for k in fitting if channels[k] == most)
    named = [k for k in fitting if not _units(lines[k], delimiter, width)] or fitting
    return named[0] if first in named else named[-1]


def _channels(text: str, delimiter: str) -> int:
    return sum(is_channel(parse_header(cell)[0]) for cell in _names(text, delimiter))


def _units(text: str, delimiter: str, width: int) -> list[str]:
    """The units in a line that holds nothing else; empty where it is another line."""
    cells = [cell.strip("[]() ") for cell in _names(text, delimiter)]
    cells = ["" if cell == "-" else cell for cell in cells]
    plain = len(cells) == width and any(cells)
    return cells if plain and all(not cell or is_unit(cell) for cell in cells) else []


def _with_units(file: str, cells: list[str], units: list[str]) -> list[str]:
    """The columns' names, with the units of a line of their own."""
    if all(map(is_number, cells)):
        raise InputError(f"{file} has no header line; write the columns' names in line 1.")
    check_distinct(file, [name for name in cells if name])
    names = []
    for k, cell in enumerate(cells):
        name = cell or f"column {k + 1}"
        unit = units[k] if units else ""
        names.append(f"{name} [{unit}]" if unit and not parse_header(name)[1] else name)
    return names
