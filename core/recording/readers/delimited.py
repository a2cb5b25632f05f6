"""Text tables: CSV with commas, semicolons or tabs, also gzipped."""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from pathlib import Path

import numpy as np

from core.errors import InputError
from core.recording.table import Table, TableReader, damaged, number

DELIMITERS = ",;\t"


class DelimitedReader(TableReader):
    """One header line, then one line per sample."""

    kind = ".csv .csv.gz .txt .tsv"

    def read(self, path: Path) -> Table:
        text = _text(path)
        lines = _LINE_END.split(text)
        while lines and not lines[-1].strip():
            lines.pop()
        if not lines:
            raise InputError(f"{path.name} is empty; give a file with a header line and samples.")
        delimiter = max(DELIMITERS, key=lines[0].count)
        header = _header(path, lines[0], delimiter)
        if len(lines) == 1:
            raise InputError(f"{path.name} has a header line but no samples below it.")
        rows = _split(path, lines[1:], delimiter, len(header))
        decimal = "," if delimiter == ";" and any("," in line for line in lines[1:]) else "."
        cells = zip(*rows, strict=True)
        columns = {name: _array(col, decimal) for name, col in zip(header, cells, strict=True)}
        cut = () if text.endswith(("\n", "\r")) else (_NO_LINE_END.format(name=path.name),)
        return Table(path.name, columns, first_line=2, warnings=cut)


_LINE_END = re.compile(r"\r\n|\n|\r")
"""Not str.splitlines, which also cuts at signs that other encodings leave inside a header."""
_NO_LINE_END = "{name} ends without a line break; if it was cut short, its last number is wrong."


def _text(path: Path) -> str:
    try:
        raw = (
            gzip.decompress(path.read_bytes())
            if path.suffix.lower() == ".gz"
            else path.read_bytes()
        )
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise damaged(path, "a gzip file", error) from error
    if b"\0" in raw:
        raise damaged(path, "a text table")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")  # older programs write the degree sign so; it never fails


def _header(path: Path, line: str, delimiter: str) -> list[str]:
    cells = next(csv.reader([line.lstrip("# ")], delimiter=delimiter), [])
    names = [cell.strip() for cell in cells]
    if all(_is_number(name) for name in names):
        raise InputError(f"{path.name} has no header line; write the columns' names in line 1.")
    doubled = sorted({name for name in names if name and names.count(name) > 1})
    if doubled:
        raise InputError(f"{path.name} has two columns {doubled[0]}; rename or remove one.")
    return [name or f"column {k + 1}" for k, name in enumerate(names)]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _split(path: Path, lines: list[str], delimiter: str, expected: int) -> list[list[str]]:
    """The cells of the lines below the header; every line has as many as the header."""
    if any('"' in line for line in lines):
        rows = [next(csv.reader([line], delimiter=delimiter), []) for line in lines]
    else:
        rows = [line.split(delimiter) if line.strip() else [] for line in lines]
    for index, row in enumerate(rows, start=1):
        if len(row) != expected:
            cut = index == len(rows) and len(row) < expected
            advice = "the file was cut short" if cut else "complete or remove the row"
            raise InputError(
                f"{path.name}: data row {index} (line {index + 1}) has {len(row)} fields where "
                f"the header has {expected}; {advice}."
            )
    return rows


def _array(cells: tuple[str, ...], decimal: str) -> np.ndarray:
    """Numbers where every cell is one, else the cells as they are."""
    if decimal != ".":
        cells = tuple(cell.replace(decimal, ".") for cell in cells)
    try:
        return np.array([number(cell) for cell in cells])
    except ValueError:
        return np.array(cells, dtype=object)
