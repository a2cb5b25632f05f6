"""The lines of a text table, a block at a time: fast where all is as it should be, careful else."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from core.errors import InputError
from core.recording.table import NO_NUMBER, cell_fault, number, row_name

COMMA_DECIMALS = ";\t"
"""Between these delimiters a comma stands for the decimal point."""
EMPTY = sorted({s for word in NO_NUMBER for s in (word, word.upper(), word.title())} | {"NaN"})
"""The usual ways to write 'no sample'; unusual ones are read carefully."""
_LINE_END = re.compile(r"\r\n|\n|\r")


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
        lines = _LINE_END.split(text)
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


def _decoded(raw: bytes) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")
