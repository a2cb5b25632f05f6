"""What a study has found so far, drawn: ready to be sent to a page."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from core.montecarlo.summary import Summary
from flexgui.export.plot import Plot
from flexgui.export.study_report import sections
from flexgui.views.html import html_table
from flexgui.views.study_estimates import parameter_table, snr, stiffness_table
from flexgui.views.table import Table

FINDINGS = "Conclusions"

FONT_SIZE = 11
"""Of a figure on the page; a report has more room."""


@dataclass(frozen=True)
class ShownFigure:
    """One figure as Plotly reads it."""

    figure: dict[str, Any]
    height: float
    """px"""
    caption: str


@dataclass(frozen=True)
class ShownSection:
    """Figures, and tables or paragraphs below them."""

    title: str
    figures: tuple[ShownFigure, ...]
    words: Markup


def shown(summary: Summary) -> tuple[ShownSection, ...]:
    """The report's sections as far as there are results, and its findings."""
    found = []
    for section in sections(summary):
        figures = tuple(_figure(plot) for plot in section.figures)
        tables = _narrow(summary) if section.id == "estimates" else ()
        own = section.tables[2:] if tables else section.tables
        words = Markup("").join(_table(title, table) for title, table in (*tables, *own))
        found.append(ShownSection(section.title, figures, words))
    if summary.findings:
        said = (_paragraph(heading, text) for heading, text in summary.findings)
        found.append(ShownSection(FINDINGS, (), Markup("").join(said)))
    return tuple(found)


def _narrow(summary: Summary) -> Iterator[tuple[str, Table]]:
    """The two wide tables of the report ratio by ratio: a page has half its width."""
    for table in summary.tables:
        yield f"Estimates at {snr(table.snr_db)}", parameter_table([table])
    for table in summary.tables:
        yield f"EI at {snr(table.snr_db)}", stiffness_table([table], summary.stiffness)


def _figure(plot: Plot) -> ShownFigure:
    figure = json.loads(plot.json)
    layout = figure["layout"]
    layout |= {"template": "none", "font": {**layout["font"], "size": FONT_SIZE}}
    return ShownFigure(figure, float(plot.height), plot.caption)


def _table(title: str, table: Table) -> Markup:
    return Markup("<h4>{}</h4>{}").format(title, html_table(table))


def _paragraph(heading: str, text: str) -> Markup:
    return Markup("<h4>{}</h4><p>{}</p>").format(heading, text)
