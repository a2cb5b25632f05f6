"""The generated functions of an arm for LANES arms at once, from the same statements.

A number becomes a wide one (core.lanes), an entry of an array a row of one; the arithmetic stays
as it is.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

_RULES = (
    (re.compile(r"^(\s*)(\w+) = (q|v|p)\[(\d+)\]$"), r"\1\2 = get(\3, \4)"),
    (re.compile(r"^(\s*)([fM](?:_\d+)+) = 0\.0$"), r"\1\2 = spread(0.0)"),
)
_ENTRY = re.compile(r"^(\s*)(\w+)\[(\w+)(?:, (\w+))?\] (\+?)= (.+)$")
_CLEARED = re.compile(r"^(\s*)(\w+)\[:(, :)?\] = 0\.0$")
_LOOP = re.compile(r"range\(f\.size\)")


def widened(lines: Sequence[str], columns: int) -> list[str]:
    """Statements of core.arm.generate for wide numbers; matrices have `columns` columns."""
    return [_widened(line, columns) for line in lines]


def _widened(line: str, columns: int) -> str:
    for pattern, wide in _RULES:
        if pattern.match(line):
            return pattern.sub(wide, line)
    if found := _CLEARED.match(line):
        indent, name, _ = found.groups()
        return f"{indent}for k in range({name}.shape[0]): put({name}, k, 0.0)"
    if found := _ENTRY.match(line):
        indent, name, row, column, plus, value = found.groups()
        at = row if column is None else f"{row} * {columns} + {column}"
        value = re.sub(r"\bM\[(\w+), (\w+)\]", rf"get(M, \1 * {columns} + \2)", value)
        return f"{indent}put({name}, {at}, {f'get({name}, {at}) + ' if plus else ''}{value})"
    return _LOOP.sub("range(f.shape[0])", line)
