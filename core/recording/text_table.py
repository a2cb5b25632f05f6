"""Tables as text: where their heading is, how their cells are separated, and blocks of their
rows.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from core.errors import InputError
from core.recording.channels import is_channel
from core.recording.table import NO_NUMBER, cell_fault, number, row_name
from core.written import is_unit, parse_header

DELIMITERS = ",;\t"
MOST_LINES = 300
"""Above the samples; the longest headers of drives' scopes have a few dozen."""
COMMENT = "#%/!"
"""With one of these begins a line that programs write above their tables."""
_LINE_END = re.compile(rb"\r\n|\n|\r")
"""Not bytes.splitlines, which also cuts at signs that other encodings leave inside a header."""
_ROUND = re.compile(r"^(?P<name>[^()\[\]]*\S)\s*\((?P<unit>[^()\[\]]+)\)$")


class _Line(NamedTuple):
    text: str
    end: int
    """Byte at which the next one begins."""


class Heading(NamedTuple):
    """What stands above the samples."""

    names: list[str]
    """With their units, `theta1 [deg]`."""
    delimiter: str
    first_line: int
    """Of the file, with data row 1."""
    body: int
    """Byte at which the samples begin."""
    written: dict[str, str]
    """Name as the file writes it -> name here, where the two differ."""


def read_heading(file: str, block: bytes) -> Heading:
    """The heading of a table whose first bytes are `block`; InputError where it has none."""
    lines = list(_lines(block))
    used = [k for k, line in enumerate(lines) if line.text.strip()]
    delimiter, width = _delimiter(lines)
    data = next((k for k in used if _is_sample(lines[k].text, delimiter, width)), None)
    top = _header_line(lines, used, data, delimiter, width)
    if not width:
        delimiter = max(DELIMITERS, key=lines[top].text.count)
    cells = _names(lines[top].text, delimiter)
    below = top + 1
    units: list[str] = []
    if below < len(lines) and below != data:
        units = _units(lines[below].text, delimiter, len(cells))
        below += bool(units)
    names, written = _with_units(file, cells, units)
    return Heading(names, delimiter, below + 1, lines[below - 1].end, written)


def _lines(block: bytes) -> Iterator[_Line]:
    start = 0
    for _ in range(MOST_LINES):
        found = _LINE_END.search(block, start)
        end = len(block) if found is None else found.start()
        after = end if found is None else found.end()
        yield _Line(_decoded(block[start:end]), after)
        start = after
        if found is None or start >= len(block):
            return


def _decoded(raw: bytes) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")  # older programs write the degree sign so; it never fails


def _cells(text: str, delimiter: str) -> list[str]:
    if '"' not in text:
        return [cell.strip() for cell in text.split(delimiter)] if text.strip() else []
    try:
        return [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter), [])]
    except csv.Error:
        return []


def _names(text: str, delimiter: str) -> list[str]:
    """Cells of a header line, which may stand in a comment."""
    return _cells(text.lstrip(COMMENT + " "), delimiter)


def _delimiter(lines: list[_Line]) -> tuple[str, int]:
    """The one that cuts most lines into equally many numbers, and how many; width 0: none."""
    best, found = (0, 0), (DELIMITERS[0], 0)
    for delimiter in DELIMITERS:
        widths = [_sample_width(line.text, delimiter) for line in lines]
        for width in {w for w in widths if w > 1}:
            if (score := (widths.count(width), width)) > best:
                best, found = score, (delimiter, width)
    return found


def _is_sample(text: str, delimiter: str, width: int) -> bool:
    return width > 0 and _sample_width(text, delimiter) == width


def _sample_width(text: str, delimiter: str) -> int:
    """Cells of a line most of which are numbers; 0 of another line."""
    cells = _cells(text, delimiter)
    full = [cell for cell in cells if cell]
    numbers = sum(is_number(cell, delimiter) for cell in full)
    return len(cells) if full and 2 * numbers > len(full) else 0


def is_number(cell: str, delimiter: str = ",") -> bool:
    """Whether a cell is a number, with a decimal comma where the delimiter is none."""
    try:
        number(cell.replace(",", ".") if delimiter in COMMA_DECIMALS else cell)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


def _header_line(
    lines: list[_Line], used: list[int], data: int | None, delimiter: str, width: int
) -> int:
    """Of the lines above the samples as wide as they are, that with most channels; the last one
    that is no row of units where none has any. Else the first line with text."""
    first = next((k for k in used if lines[k].text.strip()[0] not in COMMENT), used[0])
    fitting = [
        k
        for k in used
        if (data is None or k < data) and len(_names(lines[k].text, delimiter)) == width
    ]
    if data is None or not fitting:
        return first
    channels = {k: _channels(lines[k].text, delimiter) for k in fitting}
    most = max(channels.values())
    if most:
        return next(k for k in fitting if channels[k] == most)
    named = [k for k in fitting if not _units(lines[k].text, delimiter, width)] or fitting
    return named[0] if first in named else named[-1]


def _channels(text: str, delimiter: str) -> int:
    return sum(is_channel(parse_header(_square(cell))[0]) for cell in _names(text, delimiter))


def _units(text: str, delimiter: str, width: int) -> list[str]:
    """The units in a line that holds nothing else; empty where it is another line."""
    cells = [cell.strip("[]() ") for cell in _names(text, delimiter)]
    cells = ["" if cell == "-" else cell for cell in cells]
    plain = len(cells) == width and any(cells)
    return cells if plain and all(not cell or is_unit(cell) for cell in cells) else []


def _square(cell: str) -> str:
    """`theta1 (deg)` as `theta1 [deg]`."""
    found = _ROUND.match(cell)
    return f"{found['name']} [{found['unit']}]" if found and is_unit(found["unit"]) else cell


def _with_units(file: str, cells: list[str], units: list[str]) -> tuple[list[str], dict[str, str]]:
    if all(is_number(name) for name in cells):
        raise InputError(f"{file} has no header line; write the columns' names in line 1.")
    given = [name for name in cells if name]
    if len(set(given)) < len(given):
        doubled = next(name for k, name in enumerate(given) if name in given[:k])
        raise InputError(f"{file} has two columns {doubled}; rename or remove one.")
    names = []
    for k, cell in enumerate(cells):
        name = _square(cell) or f"column {k + 1}"
        unit = units[k] if units else ""
        names.append(f"{name} [{unit}]" if unit and not parse_header(name)[1] else name)
    return names, {cell: name for cell, name in zip(cells, names, strict=True) if cell != name}


COMMA_DECIMALS = ";\t"
"""Between these delimiters a comma stands for the decimal point."""
EMPTY = sorted({s for word in NO_NUMBER for s in (word, word.upper(), word.title())} | {"NaN"})
"""The usual ways to write 'no sample'; unusual ones are read carefully."""
_TEXT_LINE_END = re.compile(r"\r\n|\n|\r")


def has_cells(block: bytes) -> bool:
    """Whether there is anything but white space."""
    return bool(block.strip())


class BlockParser:
    """Takes the lines below the header in order; every line has as many cells as the header."""

    def __init__(self, source: str, width: int, delimiter: str, first_line: int = 2) -> None:
        self.rows = 0
        self._first_line = first_line
        self._source, self._width, self._delimiter = source, width, delimiter
        self._parts: list[list[np.ndarray]] = [[] for _ in range(width)]
        self._faults: dict[int, str] = {}
        self._blank_row: int | None = None

    def add(self, block: bytes, last: bool = False) -> None:
        """Whole lines; `last` where nothing follows. InputError at a line of another length."""
        body, blanks = _without_blank_end(block)
        if body:
            if self._blank_row is not None:
                raise self._length_error(self._blank_row, 0, "complete or remove the row")
            columns = self._fast(body)
            columns = self._careful(body, last) if columns is None else columns
            for part, values in zip(self._parts, columns, strict=True):
                part.append(values)
            self.rows += len(columns[0])
        if blanks and self._blank_row is None:
            self._blank_row = self.rows

    def finish(self, header: Sequence[str]) -> tuple[dict[str, np.ndarray], dict[str, str]]:
        """Columns (N,) by name, and what is wrong in those where not all cells are numbers.

        Of such a column, only the numbers up to the end of the block with the first fault are kept.
        """
        columns = {}
        for k, name in enumerate(header):
            parts, self._parts[k] = self._parts[k], []
            columns[name] = np.concatenate(parts) if parts else np.full(self.rows, np.nan)
        return columns, {header[k]: fault for k, fault in self._faults.items()}

    def _fast(self, body: bytes) -> list[np.ndarray] | None:
        """By Arrow; None where a cell is no plain number or a line has another length."""
        import pyarrow as pa
        from pyarrow import csv as arrow

        if b'"' in body:
            return None
        names = [str(k) for k in range(self._width)]
        wanted = [name for k, name in enumerate(names) if k not in self._faults]
        decimal = "," if self._delimiter in COMMA_DECIMALS and b"," in body else "."
        try:
            found: Any = arrow.read_csv(
                pa.BufferReader(body),
                arrow.ReadOptions(column_names=names, use_threads=False, block_size=len(body) + 1),
                arrow.ParseOptions(
                    delimiter=self._delimiter, quote_char=False, ignore_empty_lines=False
                ),
                arrow.ConvertOptions(
                    column_types=dict.fromkeys(wanted, pa.float64()),
                    include_columns=wanted or names[:1],
                    null_values=EMPTY,
                    decimal_point=decimal,
                    check_utf8=False,
                ),
            )
        except (pa.ArrowInvalid, pa.ArrowKeyError, pa.ArrowTypeError):
            return None
        nothing = np.full(found.num_rows, np.nan)
        return [
            found.column(name).to_numpy() if k not in self._faults else nothing
            for k, name in enumerate(names)
        ]

    def _careful(self, body: bytes, last: bool) -> list[np.ndarray]:
        """Cell by cell, so that a sentence can say which one is wrong."""
        rows = self._split(_decoded(body), last)
        return [self._column(k, cells) for k, cells in enumerate(zip(*rows, strict=True))]

    def _split(self, text: str, last: bool) -> list[list[str]]:
        lines = _TEXT_LINE_END.split(text)
        if not lines[-1]:
            lines.pop()
        try:
            rows = [self._cells(line) for line in lines]
        except csv.Error as error:
            raise InputError(f"{self._source} is damaged or not a text table ({error}).") from error
        for index, row in enumerate(rows):
            if len(row) != self._width:
                cut = last and index == len(rows) - 1 and len(row) < self._width
                advice = "the file was cut short" if cut else "complete or remove the row"
                raise self._length_error(self.rows + index, len(row), advice)
        return rows

    def _cells(self, line: str) -> list[str]:
        if '"' in line:
            return next(csv.reader([line], delimiter=self._delimiter), [])
        return line.split(self._delimiter) if line.strip() else []

    def _column(self, k: int, cells: tuple[str, ...]) -> np.ndarray:
        values = np.full(len(cells), np.nan)
        if k in self._faults:
            return values
        for index, cell in enumerate(cells):
            try:
                plain = cell.replace(",", ".") if self._delimiter in COMMA_DECIMALS else cell
                values[index] = number(plain)
            except ValueError:
                fault = cell_fault(cell, row_name(self.rows + index, self._first_line))
                self._faults.setdefault(k, fault)
        return values

    def _length_error(self, index: int, length: int, advice: str) -> InputError:
        row = row_name(index, self._first_line)
        return InputError(
            f"{self._source}: {row} has {length} fields where the header has {self._width}; "
            f"{advice}."
        )


def _without_blank_end(block: bytes) -> tuple[bytes, bool]:
    """The block up to its last line with cells, and whether blank lines follow that."""
    used = len(block.rstrip())
    if not used:
        return b"", bool(block)
    ends = [block.find(sign, used) for sign in (b"\n", b"\r")]
    end = min((e for e in ends if e >= 0), default=len(block))
    rest = block[end:]
    line_end = 2 if rest.startswith(b"\r\n") else min(len(rest), 1)
    return block[: end + line_end], len(rest) > line_end
