"""A hook of MkDocs: formulas become MathML, which a browser shows without a script or a network."""

from __future__ import annotations

import re
from typing import Any

from latex2mathml.converter import convert

CODE = re.compile(r"(^```.*?^```$|`[^`\n]+`)", re.MULTILINE | re.DOTALL)
FORMULA = re.compile(r"\$\$(.+?)\$\$|\$([^$\n]+)\$", re.DOTALL)
PLACE = "formula-{}-here"
TAKEN = re.compile(r"formula-(\d+)-here")

_formulas: dict[str, list[str]] = {}
"""Address of a page -> its formulas as MathML, in their order."""


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Put a plain word in the place of each formula outside code; Markdown would change it."""
    found = _formulas[page.url] = []

    def taken(match: re.Match[str]) -> str:
        block = match[1] is not None
        found.append(convert(match[1] or match[2], display="block" if block else "inline"))
        return PLACE.format(len(found) - 1)

    parts = CODE.split(markdown)
    return "".join(part if k % 2 else FORMULA.sub(taken, part) for k, part in enumerate(parts))


def on_page_content(html: str, *, page: Any, **_: Any) -> str:
    """Put the formulas in."""
    return TAKEN.sub(lambda match: _formulas[page.url][int(match[1])], html)
