"""A file's columns as they stand there, before any meaning is given to them, and the contract of a
reader."""

from __future__ import annotations

import contextlib
import io
import logging
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from ..errors import InputError
from ..units import parse_header


@dataclass(frozen=True)
class Listed:
    """A topic, group or sheet of a file, as a person is shown it."""

    name: str
    columns: tuple[str, ...]
    rows: int
    rate: float | None
    """Hz, on average; None without a clock."""
    span: float | None
    """s"""


@dataclass(frozen=True)
class Table:
    """Columns (N,) by their header; a column with text in it is of objects, others of numbers."""

    source: str
    """The file's name, as messages say it."""
    columns: Mapping[str, np.ndarray]
    first_line: int | None = None
    """The line of the file that holds data row 1; None where the file has no lines."""
    unusable: Mapping[str, str] = field(default_factory=dict)
    """Header -> what is wrong with a column that cannot be used: an error only when asked for."""
    warnings: tuple[str, ...] = ()
    faults: Mapping[str, str] = field(default_factory=dict)
    """Header -> what is wrong in one of its cells: an error only when the numbers are asked for."""
    groups: tuple[Listed, ...] = ()
    """Of a file with several clocks or places; empty where all is one table."""
    paths: Mapping[str, str] = field(default_factory=dict)
    """Whole path in the file -> header, where the header is only the path's end."""

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self.columns.values()), ()))

    def row(self, index: int) -> str:
        """How messages name a row, `data row 5 (line 6)`, from its index from 0."""
        return row_name(index, self.first_line)

    def numbers(self, header: str) -> np.ndarray:
        """A column as float64 (N,), NaN where the cell is empty; InputError for one that cannot be
        used."""
        if header in self.faults:
            raise InputError(f"{self.source}: column {header} {self.faults[header]}")
        column = self.columns[header]
        values = column if column.dtype == np.float64 else self._converted(header, column)
        infinite = np.flatnonzero(np.isinf(values))
        if infinite.size:
            raise InputError(
                f"{self.source}: column {header} is infinite in {self.row(infinite[0])}; "
                f"write a number there."
            )
        return values

    def _converted(self, header: str, column: np.ndarray) -> np.ndarray:
        values = np.empty(len(column))
        for index, cell in enumerate(column):
            try:
                values[index] = number(cell)
            except (TypeError, ValueError, OverflowError):
                raise InputError(
                    f"{self.source}: column {header} {cell_fault(cell, self.row(index))}"
                ) from None
        return values


def in_seconds(header: str, values: np.ndarray) -> tuple[str, np.ndarray]:
    """Durations, or dates from the first one on, `values` (N,), in the unit that the header then
    has; other columns as they are."""
    if values.dtype.kind not in "mM":
        return header, values
    spans = values - values[0] if values.dtype.kind == "M" else values
    return f"{parse_header(header)[0]} [s]", spans / np.timedelta64(1, "s")


def check_distinct(source: str, names: Sequence[str]) -> None:
    """InputError where two columns have one name."""
    doubled = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if doubled is not None:
        raise InputError(f"{source} has two columns {doubled}; rename or remove one.")


def row_name(index: int, first_line: int | None) -> str:
    """`data row 5 (line 6)` from the row's index from 0 and the line of the file with row 1."""
    line = "" if first_line is None else f" (line {first_line + index})"
    return f"data row {index + 1}{line}"


def cell_fault(cell: object, row: str) -> str:
    """What is wrong with a cell that is no number, as the end of a sentence."""
    return f"holds {str(cell)[:40]!r} in {row}; write a number there."


NO_NUMBER = ("", "nan", "na")
"""How a cell says 'no sample', in lower case."""


def number(cell: object, comma: bool = False) -> float:
    """A cell as a number; NaN for 'no sample', else ValueError or TypeError. `comma`: the decimal
    point may be a comma."""
    if cell is None:
        return float("nan")
    if isinstance(cell, bool | np.bool_):
        raise TypeError("a truth value is not a measurement")
    if not isinstance(cell, str):
        return float(cell)  # type: ignore[arg-type]
    text = cell.strip().replace(",", ".") if comma else cell.strip()
    if text.lower() in NO_NUMBER:
        return float("nan")
    if "_" in text:  # Python reads 1_000 as a thousand, no measuring program writes it
        raise ValueError(text)
    return float(text)


def is_number(cell: object, comma: bool = False) -> bool:
    """Whether a cell is a number, or says 'no sample'."""
    try:
        number(cell, comma)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


class TableReader(ABC):
    """Reads one kind of file; `kind` lists its usual suffixes, if any, separated by blanks."""

    kind = ""
    file_type = "a table"
    """As what a damaged file cannot be read."""
    needs: tuple[str, ...] = ()
    """Modules of the extra `lab` that it imports."""
    folder = ("", "")
    """A file by which a folder is known as a set of such files, and the pattern of their paths in
    it; empty where files stand by themselves."""

    @abstractmethod
    def fits(self, path: Path, start: bytes) -> int:
        """How well the first bytes match this kind of file; 0: not at all; the highest number
        wins."""

    @abstractmethod
    def read(self, path: Path, reading: Reading) -> Table:
        """The file's table; InputError where it is, as `reading` counts, too large, and any other
        error where it is damaged."""


def damaged(name: str, file_type: str, error: Exception | None = None) -> InputError:
    """The error for a file that cannot be read as what its name says."""
    reason = f" ({str(error).splitlines()[0][:80]})" if error is not None and str(error) else ""
    return InputError(
        f"{name} is damaged, cut short or not {file_type}{reason}; export it again from its source."
    )


@contextlib.contextmanager
def quiet(package: str) -> Iterator[None]:
    """A library logs and prints what it meets in a damaged file, where one sentence is expected."""
    logs = [logging.getLogger(name) for name in list(logging.root.manager.loggerDict)]
    ours = [(log, log.disabled) for log in logs if log.name.split(".")[0] == package]
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    for log, _ in ours:
        log.disabled = True
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        sys.unraisablehook = hook
        for log, before in ours:
            log.disabled = before


MOST_BYTES = 400_000_000
"""Unpacked: the text of MOST_CELLS numbers with all their digits."""
MOST_CELLS = 20_000_000
"""Half an hour of ten channels at 1 kHz: 160 MB, of which a fit keeps several copies."""
MOST_ROWS = 5_000_000
"""Samples of one recording: an hour at 1.4 kHz."""
MEGA = 1e6


class Watching(Protocol):
    """What it needs of whoever waits: see `core.progress.Progress`."""

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps are done; `text` says of what."""

    def stopped(self) -> bool:
        """Whether reading should end."""


class Reading:
    """Counts while a file is read and says how far it is; `took` and `grew` raise InputError."""

    def __init__(self, path: Path, progress: Watching | None = None) -> None:
        self.name = path.name
        self._size = max(path.stat().st_size, 1)
        self._progress = progress
        self._unpacked = 0
        self.took(0)

    def took(self, position: int) -> None:
        """The file is read up to `position` bytes; InputError where nobody waits for the rest."""
        if self._progress is None:
            return
        if self._progress.stopped():
            raise InputError(f"Stopped while {self.name} was read.")
        share = min(position / self._size, 1.0)
        self._progress.advance(0, f"{self.name}, {share:.0%} read")

    def grew(self, size: int) -> None:
        """Another `size` bytes are unpacked; InputError where they become too many."""
        self._unpacked += size
        if self._unpacked > MOST_BYTES:
            raise InputError(
                f"{self.name} unpacks to more than {MOST_BYTES / MEGA:.0f} MB; cut the recording "
                f"or keep fewer columns."
            )

    def holds(self, rows: int, columns: int) -> None:
        """So many rows and columns are known to be in it; InputError where they are too many."""
        if rows > MOST_ROWS:
            raise InputError(
                f"{self.name} has more than {MOST_ROWS:,} samples; cut it into shorter recordings."
            )
        if rows * columns > MOST_CELLS:
            raise InputError(
                f"{self.name} has more than {MOST_CELLS:,} numbers; cut the recording or keep "
                f"fewer columns."
            )


WIDEST = 64
"""Columns of one array that are channels; a wider one is a picture."""


def as_vectors(
    name: str,
    values: np.ndarray,
    columns: dict[str, np.ndarray],
    unusable: dict[str, str],
    unit: str = "",
) -> None:
    """Adds the columns of `values` of any shape, header -> (N,), to `columns`, or what is wrong
    with it to `unusable`. An array theta (N, 2), or (2, N), gives theta1 and theta2; a structured
    one its fields. `name`: path in the file; `unit`: empty where the file says none."""
    header = f"{name} [{unit}]" if unit else name
    if values.dtype.names:
        for part in values.dtype.names:
            as_vectors(f"{name}/{part}", values[part], columns, unusable)
        return
    if values.dtype.kind not in "iuf":
        unusable[header] = "is not an array of real numbers"
        return
    values = np.squeeze(values)
    if values.ndim == 0:
        unusable[header] = "is a single number, not a vector"
    elif values.ndim == 1:
        columns[header] = values.astype(float) if values.dtype.kind == "f" else values
    elif values.ndim == 2 and min(values.shape) <= WIDEST:
        rows = values if values.shape[0] >= values.shape[1] else values.T
        for k in range(rows.shape[1]):
            end = f"{name}{k + 1}"
            columns[f"{end} [{unit}]" if unit else end] = rows[:, k].astype(float)
    else:
        unusable[header] = f"is not a vector but has {values.ndim} dimensions"
