"""Text tables: CSV with commas, semicolons or tabs, decimal commas too, also gzipped."""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import IO, Any

import numpy as np

from ...errors import InputError
from ...recording.header import Heading, cells_of, decoded, read_heading
from ...recording.table import (
    NO_NUMBER,
    Reading,
    Table,
    TableReader,
    cell_fault,
    damaged,
    number,
    row_name,
)  # fmt: skip

BLOCK = 1_000_000
"""Bytes that are parsed at once: a hundredth of a second, and no progress bar needs more steps."""
LONGEST_LINE = 1_000_000
"""Bytes: a sample of thousands of channels is shorter."""


class DelimitedReader(TableReader):
    """Comments, a header line, perhaps one of units, then one line per sample."""

    kind = ".csv .csv.gz .txt .tsv"
    file_type = "a text table"

    def fits(self, path: Path, start: bytes) -> int:
        if start.startswith(_GZIP):
            return 2
        # Any other format begins with a signature; a text has neither NUL nor control signs.
        return int(bool(start.strip()) and not _CONTROL.search(start))

    def read(self, path: Path, reading: Reading) -> Table:
        with _opened(path) as (content, packed):
            blocks = _blocks(path, content, packed, reading)
            first = next(blocks, b"").removeprefix(_MARK)
            if not first.strip():
                raise InputError(f"{path.name} is empty; give a file with a header and samples.")
            heading = read_heading(path.name, first)
            samples, last = _Samples(path.name, heading), first
            for block in chain([first[heading.body :]], blocks):
                if block.strip():
                    samples.add(block)
                    last = block
                reading.holds(samples.rows, len(heading.names))
        if samples.rows == 0:
            raise InputError(f"{path.name} has a header and no samples; give a file with samples.")
        return Table(
            path.name,
            dict(zip(heading.names, map(np.concatenate, samples.columns), strict=True)),
            first_line=heading.first_line,
            warnings=() if last.endswith(_ENDS) else (_NO_LINE_END.format(name=path.name),),
            faults={heading.names[k]: fault for k, fault in samples.faults.items()},
        )


_GZIP = b"\x1f\x8b"
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
_ENDS = (b"\n", b"\r")
_LINE_END = re.compile(rb"\r\n|\n|\r(?!\Z)")
_NO_LINE_END = "{name} ends without a line break; if it was cut short, its last number is wrong."
_MARK = b"\xef\xbb\xbf"
"""With which some programs begin UTF-8 text."""


@contextmanager
def _opened(path: Path) -> Iterator[tuple[IO[bytes], IO[bytes]]]:
    """What is in the file, and the file itself, whose position says how far it is read."""
    with path.open("rb") as packed:
        magic = packed.read(len(_GZIP))
        packed.seek(0)
        if magic != _GZIP and (path.suffix.lower() != ".gz" or magic.strip()):
            yield packed, packed
            return
        try:
            with gzip.GzipFile(fileobj=packed) as content:
                yield content, packed  # type: ignore[misc]
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise damaged(path.name, "a gzip file", error) from error


def _blocks(path: Path, content: IO[bytes], packed: IO[bytes], reading: Reading) -> Iterator[bytes]:
    """The content in pieces that end where a line ends, without blank lines at its end."""
    buffer = b""
    while piece := content.read(BLOCK):
        reading.grew(len(piece))
        reading.took(packed.tell())
        if b"\0" in piece:
            raise damaged(path.name, DelimitedReader.file_type)
        buffer += piece
        end = _whole_lines(buffer)
        if len(buffer) - end > LONGEST_LINE:
            raise InputError(
                f"{path.name} has a line of more than {LONGEST_LINE:,} characters; it is not a "
                f"table with one sample per line."
            )
        if end:
            yield buffer[:end]
            buffer = buffer[end:]
    if buffer.strip():
        yield buffer


def _whole_lines(text: bytes) -> int:
    """Bytes up to the end of the last line that is complete and not blank."""
    used = len(text.rstrip())
    if used and (line_end := _LINE_END.search(text, used)):
        return line_end.end()
    return max(text.rfind(end, 0, used) for end in _ENDS) + 1


class _Samples:
    """What the lines below the heading hold, in order; each has as many cells as the heading."""

    def __init__(self, file: str, heading: Heading) -> None:
        self.rows = 0
        self.columns: list[list[np.ndarray]] = [[] for _ in heading.names]
        self.faults: dict[int, str] = {}
        """Column -> what is wrong where not all of its cells are numbers: of it, only the numbers
        up to the end of the block with the first fault are kept."""
        self._file, self._heading = file, heading

    def add(self, block: bytes) -> None:
        """Whole lines; InputError at a line of another length."""
        columns = self._cells(block)
        for k, (parts, cells) in enumerate(zip(self.columns, columns, strict=True)):
            unread = np.full(len(cells), np.nan)
            parts.append(unread if k in self.faults else self._numbers(k, cells))
        self.rows += len(columns[0])

    def _cells(self, block: bytes) -> list[Any]:
        """Texts (rows,) of each column."""
        import pyarrow as pa
        from pyarrow import csv as arrow

        names, lines = [str(k) for k in range(len(self.columns))], block.splitlines()
        try:
            cells = arrow.read_csv(
                pa.BufferReader(block),
                arrow.ReadOptions(column_names=names, use_threads=False, block_size=len(block) + 1),
                arrow.ParseOptions(delimiter=self._heading.delimiter),
                arrow.ConvertOptions(
                    column_types=dict.fromkeys(names, pa.string()), check_utf8=False
                ),
            )
        except pa.ArrowInvalid as error:
            raise self._wrong_length(lines, not block.endswith(_ENDS)) from error
        if cells.num_rows < len(lines):  # blank ones are left out
            raise self._wrong_length(lines, unfinished=False)
        return list(cells.columns)

    def _numbers(self, k: int, cells: Any) -> np.ndarray:
        import pyarrow as pa
        from pyarrow import compute

        text = compute.ascii_trim_whitespace(cells)
        if self._heading.comma:
            text = compute.replace_substring(text, ",", ".")
        empty = compute.is_in(compute.ascii_lower(text), pa.array(NO_NUMBER))
        try:
            numbers = compute.cast(compute.if_else(empty, None, text), pa.float64())
            return np.asarray(numbers.to_numpy())
        except pa.ArrowInvalid:
            written = cells.cast(pa.binary()).to_pylist()
            return np.array([self._number(k, row, raw) for row, raw in enumerate(written)])

    def _number(self, k: int, row: int, raw: bytes) -> float:
        """A cell, or a note of the first one that is none."""
        cell = decoded(raw)
        try:
            return number(cell, self._heading.comma)
        except ValueError:
            self.faults.setdefault(k, cell_fault(cell, self._row(row)))
            return np.nan

    def _row(self, row: int) -> str:
        return row_name(self.rows + row, self._heading.first_line)

    def _wrong_length(self, lines: list[bytes], unfinished: bool) -> InputError:
        """`unfinished`: whether the last line has no end."""
        width = len(self.columns)
        for k, line in enumerate(lines):
            length = len(cells_of(decoded(line), self._heading.delimiter))
            if length != width:
                short = unfinished and k == len(lines) - 1 and length < width
                advice = "the file was cut short" if short else "complete or remove the row"
                return InputError(
                    f"{self._file}: {self._row(k)} has {length} fields where the header has "
                    f"{width}; {advice}."
                )
        return damaged(self._file, DelimitedReader.file_type)
