"""The texts that stand below the fields of a class, in its source, for references and `help()`."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from functools import cache
from textwrap import dedent, fill

from .sentences import one_line

HEAD = "Fields:"
"""Ends what the class says of itself."""


class FieldDoc:
    """The docstring of a class with its fields below; put together when somebody asks for it."""

    def __init__(self, own: str | None) -> None:
        self._own = inspect.cleandoc(own or "")

    def __get__(self, _: object, kind: type) -> str:
        lines = "\n".join(_lines(kind))
        return f"{self._own}\n\n{HEAD}\n{lines}" if lines else self._own


def _lines(kind: type) -> Iterator[str]:
    """`name = default: text` of each public argument of the class."""
    texts = {name: text for base in reversed(kind.__mro__) for name, text in field_texts(base)}
    for name, argument in inspect.signature(kind).parameters.items():
        default = "" if argument.default is argument.empty else f" = {argument.default!r}"
        field = name + default.replace(" = <factory>", " (empty by default)")
        text = f"{field}: {texts[name]}" if name in texts else field
        if not name.startswith("_"):
            yield fill(text, 90, initial_indent="    ", subsequent_indent=" " * 8)


@cache
def field_texts(kind: type) -> tuple[tuple[str, str], ...]:
    """(field, text) in the order of the class's source; none where that is not at hand."""
    try:
        tree = ast.parse(dedent(inspect.getsource(kind))).body[0]
    except (OSError, TypeError, SyntaxError):
        return ()
    found = []
    for field, text in zip(tree.body, tree.body[1:], strict=False):  # type: ignore[attr-defined]
        match field, text:
            case (
                ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str() as words)),
            ):
                found.append((name, one_line(words)))
    return tuple(found)
