"""Tables and matrices to show: texts in rows, ready for a page, a report or a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexgui.core.results import DescriptorModel
from flexgui.sentences.written import format_number


@dataclass(frozen=True)
class Column:
    """A heading; numbers stand to the right."""

    title: str
    numeric: bool = False


def texts(*titles: str) -> tuple[Column, ...]:
    """Columns of words."""
    return tuple(Column(title) for title in titles)


def numbers(*titles: str) -> tuple[Column, ...]:
    """Columns of numbers."""
    return tuple(Column(title, numeric=True) for title in titles)


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

    def only(self, kept: Sequence[int], caption: str = "") -> Table:
        """Those columns alone, for a panel beside the arm."""
        rows = tuple(Row(tuple(row.cells[k] for k in kept), row.strong) for row in self.rows)
        return Table(tuple(self.columns[k] for k in kept), rows, caption)


@dataclass(frozen=True)
class MatrixView:
    """A matrix to show; zeros are empty texts, so that the structure is seen."""

    title: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]


def matrices(model: DescriptorModel) -> tuple[MatrixView, ...]:
    """E and A term by term, then B, C and D (D only where it is not zero)."""
    states = model.states
    shown = [
        *_terms("E", model.basis, model.E_terms, states),
        *_terms("A", model.A_basis, model.A_terms, states),
        _matrix("B", model.B, states, model.inputs),
        _matrix("C", model.C, model.outputs, states),
    ]
    if np.any(model.D):
        shown.append(_matrix("D", model.D, model.outputs, model.inputs))
    return tuple(shown)


def affine(name: str, basis: tuple[str, ...]) -> str:
    """'E = E0 + cos(theta2) E1'."""
    return f"{name} = " + " + ".join(factor(f, f"{name}{k}") for k, f in enumerate(basis))


def factor(function: str, matrix: str, times: str = " ") -> str:
    """'cos(theta2) E1', or 'E0' where the function is 1."""
    return matrix if function.strip() == "1" else f"{function}{times}{matrix}"


def _terms(
    name: str, basis: tuple[str, ...], terms: np.ndarray, states: tuple[str, ...]
) -> list[MatrixView]:
    titles = [
        f"{name}{k}" if f.strip() == "1" else f"{name}{k}, times {f}" for k, f in enumerate(basis)
    ]
    return [_matrix(t, term, states, states) for t, term in zip(titles, terms, strict=True)]


def _matrix(
    title: str, values: np.ndarray, rows: tuple[str, ...], columns: tuple[str, ...]
) -> MatrixView:
    cells = tuple(tuple("" if v == 0.0 else format_number(v) for v in row) for row in values)
    return MatrixView(title, rows, columns, cells)
