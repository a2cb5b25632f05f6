"""Templates of reports, XML and programs."""

from __future__ import annotations

import re
from functools import cache
from typing import Any
from xml.etree import ElementTree

from jinja2 import Environment, PackageLoader, StrictUndefined

from flexgui.views.table import html_matrix, html_table

_NUMBER = r"\d[\d.,]*\)?(?:~×~10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?"
_NAME = r"[µmckMG]?(?:rad|deg|Pa|Hz|dB|N|m|g|s|V|A|W|J)[²³⁴]?"
_UNIT = rf"(?:%|°|(?:1~?/~?)?{_NAME}(?:(?:~?/~?|~){_NAME})*)"
_PATTERN = (
    rf"(?:~=~)?[-−]?(?:{_NUMBER}(?:~±~\(?{_NUMBER})?(?:~{_UNIT}(?![\w²³⁴])|~×(?!\S))"
    rf"|{_NUMBER}~±~{_NUMBER})"
)
_QUANTITY = re.compile(_PATTERN.replace("~", "[ \u00a0]"))
"""~ stands for a space of either kind: some of them are glued already."""
NO_BREAK = "\u00a0"


def glued(text: str) -> str:
    """The text, or Markup, with non-breaking spaces inside quantities."""
    return type(text)(_QUANTITY.sub(lambda match: match[0].replace(" ", NO_BREAK), text))


@cache
def environment() -> Environment:
    """Templates of pages and XML; user text is escaped."""
    made = Environment(
        loader=PackageLoader("flexgui.export"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["glued"] = glued
    made.globals |= {"html_table": html_table, "html_matrix": html_matrix}
    return made


def xml(template: str, /, *, declared: bool, **values: Any) -> bytes:
    """A file of XML from its template, indented, with its comments; `declared` begins as XML does
    for who asks for it."""
    source = environment().get_template(f"{template}.j2").render(values)
    keeps = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    root = ElementTree.fromstring(source, keeps)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="utf-8", xml_declaration=declared)
    return bytes(text) + b"\n"


@cache
def _programs() -> Environment:
    return Environment(
        loader=PackageLoader("flexgui.export"), undefined=StrictUndefined,
        keep_trailing_newline=True, autoescape=False,
    )  # fmt: skip


def program(template: str, /, **values: Any) -> str:
    """A program's text from its template; user text enters as plain lines only."""
    return _programs().get_template(f"{template}.j2").render(values)
