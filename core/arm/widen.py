"""The generated functions of an arm for LANES arms at once, from the same statements.

A number becomes a wide one (core.lanes), an entry of an array a row of one; the arithmetic stays
as it is.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

_READ = re.compile(r"^(\s*)(\w+) = (q|v|p)\[(\d+)\]$")
_ENTRY = re.compile(r"^(\s*)(\w+)\[(\w+)(?:, (\w+))?\] (\+?)= (.+)$")


def widened(lines: Sequence[str], columns: int) -> list[str]:
    """Statements of core.arm.generate for wide numbers; matrices have `columns` columns."""
    return [_widened(line, columns) for line in lines]


def _widened(line: str, columns: int) -> str:
    if _READ.match(line):
        return _READ.sub(r"\1\2 = get(\3, \4)", line)
    if found := _ENTRY.match(line):
        indent, name, row, column, plus, value = found.groups()
        at = row if column is None else f"{row} * {columns} + {column}"
        value = re.sub(r"\bM\[(\w+), (\w+)\]", rf"get(M, \1 * {columns} + \2)", value)
        return f"{indent}put({name}, {at}, {f'get({name}, {at}) + ' if plus else ''}{value})"
    return line
