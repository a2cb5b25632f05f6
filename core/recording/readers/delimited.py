"""Text tables: CSV with commas, semicolons or tabs, decimal commas too, also gzipped."""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import IO

from core.errors import InputError
from core.recording.table import Reading, Table, TableReader, damaged
from core.recording.text_table import BlockParser, has_cells, read_heading

BLOCK = 1_000_000
"""Bytes that are parsed at once: a hundredth of a second, and no progress bar needs more steps."""
LONGEST_LINE = 1_000_000
"""Bytes: a sample of thousands of channels is shorter."""


class DelimitedReader(TableReader):
    """Comments, a header line, perhaps one of units, then one line per sample."""

    kind = ".csv .csv.gz .txt .tsv"

    def fits(self, path: Path, start: bytes) -> int:
        if start.startswith(_GZIP):
            return 2
        # Any other format begins with a signature; a text has neither NUL nor control signs.
        return int(bool(start.strip()) and not _CONTROL.search(start))

    def read(self, path: Path, reading: Reading) -> Table:
        with _opened(path) as (content, packed):
            blocks = _blocks(path, content, packed, reading)
            first = next(blocks, b"").removeprefix(_MARK)
            if not has_cells(first):
                raise InputError(f"{path.name} is empty; give a file with a header and samples.")
            heading = read_heading(path.name, first)
            width = len(heading.names)
            parser = BlockParser(path.name, width, heading.delimiter, heading.first_line)
            ended = first
            for block, last in _with_last(chain([first[heading.body :]], blocks)):
                parser.add(block, last)
                reading.holds(parser.rows, width)
                ended = block or ended
        columns, faults = parser.finish(heading.names)
        if parser.rows == 0:
            raise InputError(f"{path.name} has a header line but no samples below it.")
        whole = ended.endswith((b"\n", b"\r"))
        return Table(
            path.name,
            columns,
            first_line=heading.first_line,
            warnings=() if whole else (_NO_LINE_END.format(name=path.name),),
            faults=faults,
            paths=heading.written,
        )


_GZIP = b"\x1f\x8b"
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
_NO_LINE_END = "{name} ends without a line break; if it was cut short, its last number is wrong."
_MARK = b"\xef\xbb\xbf"
"""With which some programs begin UTF-8 text."""


@contextmanager
def _opened(path: Path) -> Iterator[tuple[IO[bytes], IO[bytes]]]:
    """What is in the file, and the file itself, whose position says how far it is read."""
    with path.open("rb") as packed:
        magic = packed.read(len(_GZIP))
        packed.seek(0)
        if magic != _GZIP and (path.suffix.lower() != ".gz" or has_cells(magic)):
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


def _with_last(blocks: Iterator[bytes]) -> Iterator[tuple[bytes, bool]]:
    """Each block, and whether none follows it."""
    before = next(blocks)
    for block in blocks:
        yield before, False
        before = block
    yield before, True
