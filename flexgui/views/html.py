"""Tables, matrices and equations as HTML for a page; every text in them is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from markupsafe import Markup

from core.results import Equation
from flexgui.views.equations import mathml
from flexgui.views.matrices import MatrixView
from flexgui.views.table import Column, Table


def html_table(table: Table) -> Markup:
    """With its caption below."""
    head = Markup("").join(_cell("th", c, c.title) for c in table.columns)
    rows = Markup("").join(
        Markup("<tr class='{}'>{}</tr>").format(
            "strong" if row.strong else "",
            Markup("").join(
                _cell("td", column, text, row.best == k)
                for k, (column, text) in enumerate(zip(table.columns, row.cells, strict=True))
            ),
        )
        for row in table.rows
    )
    caption = Markup("<p class='soft'>{}</p>").format(table.caption) if table.caption else ""
    frame = Markup("<div class='scroll'><table><thead><tr>{}</tr></thead><tbody>{}</tbody></table>")
    return frame.format(head, rows) + Markup("</div>{}").format(caption)


def _cell(tag: str, column: Column, text: str, best: bool = False) -> Markup:
    classes = " ".join(("number" if column.numeric else "", "best" if best else "")).strip()
    return Markup("<{0} class='{1}'>{2}</{0}>").format(Markup(tag), classes, text)


def html_matrix(view: MatrixView) -> Markup:
    """Named rows and columns; zeros are empty."""
    head = Markup("").join(Markup("<th>{}</th>").format(name) for name in view.columns)
    rows = Markup("").join(
        Markup("<tr><th>{}</th>{}</tr>").format(
            name, Markup("").join(Markup("<td>{}</td>").format(cell) for cell in cells)
        )
        for name, cells in zip(view.rows, view.cells, strict=True)
    )
    frame = (
        "<h4>{}</h4><div class='scroll'><table class='matrix'><tr><th></th>{}</tr>{}</table></div>"
    )
    return Markup(frame).format(view.title, head, rows)


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
