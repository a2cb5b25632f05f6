"""Breaks long equations in LaTeX into lines: browsers do not, and cut off what is wider."""

from __future__ import annotations

import re
from collections.abc import Iterator

ALIGNED, END = r"\begin{aligned}", r"\end{aligned}"
NEXT_ROW = r" \\ "
NEXT = r"&\quad "
"""Before a line that goes on with the one above."""
SEPARATOR = re.compile(r",\s*\\qquad\s*")
"""Between two equations on one line."""


def in_lines(latex: str, width: int) -> str:
    """The equation as lines of at most about `width` characters; short ones stay as they are.

    Lines end before a plus or minus outside of fractions, roots and matrices. Brackets around a
    broken sum keep their plain size.
    """
    if _length(latex) <= width or ("begin{" in latex and not latex.startswith(ALIGNED)):
        return latex
    inner = latex.removeprefix(ALIGNED).removesuffix(END).strip()
    equations = [e for row in inner.split(NEXT_ROW) for e in SEPARATOR.split(row)]
    lines = [line for equation in equations for line in _lines(equation.strip(), width)]
    return f"{ALIGNED} {NEXT_ROW.join(lines)} {END}"


def _lines(equation: str, width: int) -> Iterator[str]:
    """One equation, aligned at its equals sign."""
    if "&" not in equation:
        equation = equation.replace("=", "&=", 1) if "=" in equation else f"& {equation}"
    if _length(equation) > width:
        equation = equation.replace(r"\left(", "(").replace(r"\right)", ")")
    line = ""
    for term in _terms(equation):
        if line and _length(line + term) > width:
            yield line.strip()
            line = NEXT
        line += term
    yield line.strip()


def _terms(equation: str) -> Iterator[str]:
    """Parts that begin with a plus or minus outside of braces; the first ends there."""
    depth, begin = 0, 0
    for k, letter in enumerate(equation):
        depth += (letter == "{") - (letter == "}")
        follows = equation[begin:k].rstrip()
        if depth == 0 and letter in "+-" and follows and follows[-1] not in "=(&^_":
            yield equation[begin:k]
            begin = k
    yield equation[begin:]


def _length(latex: str) -> int:
    """About as many characters as are seen in the widest line: of a fraction, its longer part."""
    rows = latex.removeprefix(ALIGNED).removesuffix(END).split(NEXT_ROW)
    return max(_seen(row) for row in rows)


FRACTION = re.compile(r"\\t?frac\{([^{}]*(?:\{[^{}]*\}[^{}]*)*)\}\{([^{}]*(?:\{[^{}]*\}[^{}]*)*)\}")


def _seen(row: str) -> int:
    row = FRACTION.sub(lambda found: max(found.groups(), key=_seen), row)
    row = re.sub(r"\\[A-Za-z]+", "x", row)
    return len(re.sub(r"[{}_^&\\\s]", "", row))
