"""Tables as data, and as HTML with matrices and equations; every text in it is escaped.

Put together as plain strings: Markup's own `format` takes ten times as long, and a page writes a
table with every move of a slider. LaTeX becomes MathML that a browser shows without any script, and
that cannot carry one.
"""

from __future__ import annotations

import html
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from latex2mathml.converter import convert_to_element
from markupsafe import Markup, escape

from flexgui.core.results import DescriptorModel, Equation
from flexgui.sentences.written import format_number
from flexgui.views.equation_lines import in_lines


def html_table(table: Table) -> Markup:
    """The table with its caption below."""
    head = "".join(_cell("th", column, column.title) for column in table.columns)
    rows = "".join(
        f"<tr class='{'strong' if row.strong else ''}'>{_cells(row, table.columns)}</tr>"
        for row in table.rows
    )
    caption = f"<p class='soft caption'>{escape(table.caption)}</p>" if table.caption else ""
    return Markup(
        f"<div class='scroll{' tall' if len(table.rows) > TALL_ROWS else ''}'><table>"
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>{caption}"
    )


TALL_ROWS, LONG_CELL = 16, 24
"""Rows above which a report scrolls a table, and letters above which it breaks the line of a
cell."""


def _cells(row: Row, columns: Sequence[Column]) -> str:
    return "".join(
        _cell("td", column, text, row.best == k)
        for k, (column, text) in enumerate(zip(columns, row.cells, strict=True))
    )


def _cell(tag: str, column: Column, text: str, best: bool = False) -> str:
    long = tag == "td" and len(text) > LONG_CELL and len(Markup(text).striptags()) > LONG_CELL
    named = {"number": column.numeric, "best": best, "words": long}
    classes = " ".join(name for name, true in named.items() if true)
    return f"<{tag} class='{classes}'>{escape(text)}</{tag}>"


def html_matrix(view: MatrixView) -> Markup:
    """Named rows and columns, without the title; zeros are empty."""
    head = "".join(f"<th>{escape(name)}</th>" for name in view.columns)
    rows = "".join(
        f"<tr><th>{escape(name)}</th>" + "".join(f"<td>{escape(c)}</td>" for c in cells) + "</tr>"
        for name, cells in zip(view.rows, view.cells, strict=True)
    )
    table = f"<table class='matrix'><thead><tr><th></th>{head}</tr></thead>{rows}</table>"
    return Markup(f"<div class='scroll'>{table}</div>")


def html_matrices(views: Iterable[MatrixView]) -> Markup:
    """Matrices below one another, with their titles."""
    return Markup("").join(Markup("<h4>{}</h4>{}").format(v.title, html_matrix(v)) for v in views)


def html_equations(equations: Sequence[Equation]) -> Markup:
    """Equations with title and note."""
    frame = Markup("<h4>{}</h4><div class='formula'>{}</div>{}")
    note = Markup("<p class='soft'>{}</p>")
    return Markup("").join(
        frame.format(e.title, mathml_lines(e.latex), note.format(e.note) if e.note else "")
        for e in equations
    )


PANEL, PAPER = 48, 84
"""Characters of an equation's line in a panel of the page, and in a report on paper."""


def mathml_lines(latex: str, width: int = PANEL) -> Markup:
    """A formula as MathML, in lines of about `width` characters."""
    return mathml(in_lines(latex, width))


ALLOWED = frozenset(
    "math mrow mi mn mo ms mtext mspace mfrac msqrt mroot msub msup msubsup mover munder "
    "munderover mtable mtr mtd mstyle mpadded mphantom menclose".split()
)
"""Elements of presentation MathML; anything else is not shown as a formula."""

ATTRIBUTES = frozenset(
    "display mathvariant stretchy fence form accent accentunder displaystyle scriptlevel width "
    "height depth lspace rspace columnalign rowspacing columnspacing linethickness notation "
    "minsize maxsize separator movablelimits symmetric".split()
)

SYNONYMS = (
    ("\\begin{aligned}", "\\begin{align*}"),
    ("\\end{aligned}", "\\end{align*}"),
    ("''^", "''{}^"),
)
"""What the converter does not know, and what it knows instead."""

NAMESPACE = "http://www.w3.org/1998/Math/MathML"
BRACKETS = {"[": "]", "(": ")", "|": "|"}


@lru_cache(256)
def mathml(latex: str) -> Markup:
    """A formula as MathML; the escaped LaTeX if it cannot be converted."""
    for unknown, replacement in SYNONYMS:
        latex = latex.replace(unknown, replacement)
    try:
        root = convert_to_element(latex, display="block")
        _clean(root)
    except Exception:  # the converter fails in many ways, each with an error of its own
        return Markup("<code class='latex'>") + escape(latex) + Markup("</code>")
    _frame_matrices(root)
    root.set("xmlns", NAMESPACE)
    return Markup(ET.tostring(root, encoding="unicode", short_empty_elements=False))


def _clean(element: ET.Element) -> None:
    """Keep known elements and attributes only; texts become characters, to be escaped again."""
    if element.tag not in ALLOWED:
        raise ValueError(f"no element of a formula: {element.tag}")
    element.attrib = {k: v for k, v in element.attrib.items() if k in ATTRIBUTES}
    element.text = html.unescape(element.text or "")
    element.tail = html.unescape(element.tail or "")
    for child in element:
        _clean(child)


def _frame_matrices(element: ET.Element) -> None:
    """Draws the brackets of matrices as borders.

    A browser stretches brackets only with a mathematical font, which many machines lack.
    """
    children = list(element)
    for before, table, after in zip(children, children[1:], children[2:], strict=False):
        opening = (before.text or "").strip()
        if table.tag == "mtable" and BRACKETS.get(opening) == (after.text or "").strip():
            element.remove(before)
            element.remove(after)
            table.set("class", {"[": "square", "(": "round", "|": "bars"}[opening])
    for child in element:
        _frame_matrices(child)


@dataclass(frozen=True)
class Column:
    """A heading; numbers are aligned to the right."""

    title: str
    numeric: bool = False


def texts(*titles: str) -> tuple[Column, ...]:
    """Columns of text."""
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

    def only(self, columns: Sequence[int], caption: str = "") -> Table:
        """Only these columns, for a narrow panel."""
        rows = tuple(Row(tuple(row.cells[k] for k in columns), row.strong) for row in self.rows)
        return Table(tuple(self.columns[k] for k in columns), rows, caption)


@dataclass(frozen=True)
class MatrixView:
    """A matrix to show; zeros are empty, which shows the structure."""

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


def affine(name: str, basis: tuple[str, ...], times: str = " ") -> str:
    """'E = E0 + cos(theta2) E1'."""
    terms = (
        f"{name}{k}" if function.strip() == "1" else f"{function}{times}{name}{k}"
        for k, function in enumerate(basis)
    )
    return f"{name} = {' + '.join(terms)}"


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
