"""A table to show: texts in rows, ready for a page, a report or a terminal."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """A heading; numbers stand to the right."""

    title: str
    numeric: bool = False


@dataclass(frozen=True)
class Row:
    """The texts of one row; `strong` for a mean or a best."""

    cells: tuple[str, ...]
    strong: bool = False
    best: int | None = None
    """The cell of the best value where a row compares."""


@dataclass(frozen=True)
class Table:
    """Rows of texts under headings."""

    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    caption: str = ""

    def __post_init__(self) -> None:
        if any(len(row.cells) != len(self.columns) for row in self.rows):
            raise ValueError("A row does not have a cell for each column.")
