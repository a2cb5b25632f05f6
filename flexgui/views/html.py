"""Tables, matrices and equations as HTML for a page; every text in them is escaped.

Put together as plain strings: Markup's own `format` takes ten times as long, and a page writes a
table with every move of a slider.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from markupsafe import Markup, escape

from core.results import Equation
from flexgui.views.equations import mathml
from flexgui.views.matrices import MatrixView
from flexgui.views.table import Column, Row, Table


def html_table(table: Table) -> Markup:
    """With its caption below."""
    head = "".join(_cell("th", column, column.title) for column in table.columns)
    rows = "".join(
        f"<tr class='{'strong' if row.strong else ''}'>{_cells(row, table.columns)}</tr>"
        for row in table.rows
    )
    caption = f"<p class='soft'>{escape(table.caption)}</p>" if table.caption else ""
    return Markup(
        f"<div class='scroll'><table><thead><tr>{head}</tr></thead>"
        f"<tbody>{rows}</tbody></table></div>{caption}"
    )


def _cells(row: Row, columns: Sequence[Column]) -> str:
    return "".join(
        _cell("td", column, text, row.best == k)
        for k, (column, text) in enumerate(zip(columns, row.cells, strict=True))
    )


def _cell(tag: str, column: Column, text: str, best: bool = False) -> str:
    classes = " ".join(("number" if column.numeric else "", "best" if best else "")).strip()
    return f"<{tag} class='{classes}'>{escape(text)}</{tag}>"


def html_matrix(view: MatrixView) -> Markup:
    """Named rows and columns; zeros are empty."""
    head = "".join(f"<th>{escape(name)}</th>" for name in view.columns)
    rows = "".join(
        f"<tr><th>{escape(name)}</th>" + "".join(f"<td>{escape(c)}</td>" for c in cells) + "</tr>"
        for name, cells in zip(view.rows, view.cells, strict=True)
    )
    return Markup(
        f"<h4>{escape(view.title)}</h4><div class='scroll'><table class='matrix'>"
        f"<tr><th></th>{head}</tr>{rows}</table></div>"
    )


def html_matrices(views: Iterable[MatrixView]) -> Markup:
    """One below the other."""
    return Markup("").join(html_matrix(view) for view in views)


def html_equations(equations: Sequence[Equation]) -> Markup:
    """Each with its title and note."""
    frame = Markup("<h4>{}</h4><div class='formula'>{}</div>{}")
    note = Markup("<p class='soft'>{}</p>")
    return Markup("").join(
        frame.format(e.title, mathml(e.latex), note.format(e.note) if e.note else "")
        for e in equations
    )
