"""LaTeX to MathML that a browser shows without any script, and that cannot carry one."""

from __future__ import annotations

import html
import xml.etree.ElementTree as ET

from latex2mathml.converter import convert_to_element
from markupsafe import Markup, escape

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


def mathml(latex: str, block: bool = True) -> Markup:
    """A formula as MathML; the LaTeX itself, escaped, where it cannot be converted."""
    for unknown, known in SYNONYMS:
        latex = latex.replace(unknown, known)
    try:
        root = convert_to_element(latex, display="block" if block else "inline")
        _clean(root)
    except Exception:  # the converter fails in many ways, each with an error of its own
        return Markup("<code class='latex'>") + escape(latex) + Markup("</code>")
    _frame_matrices(root)
    root.set("xmlns", NAMESPACE)
    return Markup(ET.tostring(root, encoding="unicode", short_empty_elements=False))


def _clean(element: ET.Element) -> None:
    """Keep known elements and attributes only; texts become characters, to be escaped anew."""
    if element.tag not in ALLOWED:
        raise ValueError(f"no element of a formula: {element.tag}")
    element.attrib = {k: v for k, v in element.attrib.items() if k in ATTRIBUTES}
    element.text = html.unescape(element.text or "")
    element.tail = html.unescape(element.tail or "")
    for child in element:
        _clean(child)


def _frame_matrices(element: ET.Element) -> None:
    """Draw the brackets of a matrix as borders.

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
