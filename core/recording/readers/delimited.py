"""Text tables: CSV with commas, semicolons or tabs, also gzipped."""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import IO

from core.errors import InputError
from core.recording.reading import Reading
from core.recording.table import Table, TableReader, damaged
from core.recording.text_block import BlockParser, has_cells

DELIMITERS = ",;\t"
BLOCK = 1_000_000
"""Bytes that are parsed at once: a hundredth of a second, and no progress bar needs more steps."""
LONGEST_LINE = 1_000_000
"""Bytes: a sample of thousands of channels is shorter."""


class DelimitedReader(TableReader):
    """One header line, then one line per sample."""

    kind = ".csv .csv.gz .txt .tsv"

    def read(self, path: Path, reading: Reading) -> Table:
        with _opened(path) as (content, packed):
            blocks = _blocks(path, content, packed, reading)
            first = next(blocks, b"")
            line, body = _split_off(first.removeprefix(_MARK))
            if not line:
                raise InputError(f"{path.name} is empty; give a file with a header and samples.")
            text = _decoded(line)
            delimiter = max(DELIMITERS, key=text.count)
            header = _header(path, text, delimiter)
            parser = BlockParser(path.name, len(header), delimiter)
            ended = first
            for block, last in _with_last(chain([body], blocks)):
                parser.add(block, last)
                reading.holds(parser.rows, len(header))
                ended = block or ended
        columns, faults = parser.finish(header)
        if parser.rows == 0:
            raise InputError(f"{path.name} has a header line but no samples below it.")
        whole = ended.endswith((b"\n", b"\r"))
        cut = () if whole else (_NO_LINE_END.format(name=path.name),)
        return Table(path.name, columns, first_line=2, warnings=cut, faults=faults)


_LINE_END = re.compile(rb"\r\n|\n|\r")
"""Not bytes.splitlines, which also cuts at signs that other encodings leave inside a header."""
_NO_LINE_END = "{name} ends without a line break; if it was cut short, its last number is wrong."
_MARK = b"\xef\xbb\xbf"
"""With which some programs begin UTF-8 text."""


@contextmanager
def _opened(path: Path) -> Iterator[tuple[IO[bytes], IO[bytes]]]:
    """What is in the file, and the file itself, whose position says how far it is read."""
    with path.open("rb") as packed:
        if path.suffix.lower() != ".gz":
            yield packed, packed
            return
        try:
            with gzip.GzipFile(fileobj=packed) as content:
                yield content, packed  # type: ignore[misc]
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise damaged(path, "a gzip file", error) from error


def _blocks(path: Path, content: IO[bytes], packed: IO[bytes], reading: Reading) -> Iterator[bytes]:
    """The content in pieces that end where a line ends."""
    rest = b""
    while piece := content.read(BLOCK):
        reading.grew(len(piece))
        reading.took(packed.tell())
        if b"\0" in piece:
            raise damaged(path, "a text table")
        rest += piece
        end = rest.rfind(b"\n") + 1 or rest.rfind(b"\r", 0, len(rest) - 1) + 1
        if len(rest) - end > LONGEST_LINE:
            raise InputError(
                f"{path.name} has a line of more than {LONGEST_LINE:,} characters; it is no table "
                f"with one sample per line."
            )
        if end:
            yield rest[:end]
            rest = rest[end:]
    if rest:
        yield rest


def _split_off(block: bytes) -> tuple[bytes, bytes]:
    """The first line and what follows it; no line where the block holds none at all."""
    if not has_cells(block):
        return b"", b""
    found = _LINE_END.search(block)
    return (block, b"") if found is None else (block[: found.start()], block[found.end() :])


def _with_last(blocks: Iterator[bytes]) -> Iterator[tuple[bytes, bool]]:
    """Each block, and whether none follows it."""
    before = next(blocks)
    for block in blocks:
        yield before, False
        before = block
    yield before, True


def _decoded(raw: bytes) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")  # older programs write the degree sign so; it never fails


def _header(path: Path, line: str, delimiter: str) -> list[str]:
    cells = next(csv.reader([line.lstrip("# ")], delimiter=delimiter), [])
    names = [cell.strip() for cell in cells]
    if all(_is_number(name) for name in names):
        raise InputError(f"{path.name} has no header line; write the columns' names in line 1.")
    given = [name for name in names if name]
    if len(set(given)) < len(given):
        doubled = next(name for k, name in enumerate(given) if name in given[:k])
        raise InputError(f"{path.name} has two columns {doubled}; rename or remove one.")
    return [name or f"column {k + 1}" for k, name in enumerate(names)]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
