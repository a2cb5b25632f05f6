"""The table of the numbers that decide, in docs/method.md: `python -m tests.programs.docs.numbers`.

Each named number of the packages below is a row, with its value and the first sentence of what
stands beside it in the code; a row that is there keeps its words.
"""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
METHOD = ROOT / "docs" / "method.md"
NAMES = ("check", "diagnose", "estimate", "identify", "noise", "propose")
PACKAGES = tuple(f"core/{name}" for name in NAMES)
ROW = re.compile(r"^\| `([\w.]+)\.([A-Z_]+)` \| (-?[\d.]+(?:e[+-]?\d+)?) \| (.*) \|$", re.MULTILINE)


def rows() -> dict[tuple[str, str], tuple[float, str]]:
    """(module, name) -> value and words, as the table has them."""
    text = METHOD.read_text(encoding="utf-8")
    return {(m, n): (float(value), words) for m, n, value, words in ROW.findall(text)}


def named_numbers() -> dict[tuple[str, str], str]:
    """(module, name) -> what the code says of it, for each named number of the packages."""
    found = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            for name, words in _of_module(ast.parse(path.read_text(encoding="utf-8"))):
                found[module, name] = words
    return found


def value_of(module: str, name: str) -> float:
    """As the code has it."""
    return float(getattr(importlib.import_module(f"flexgui.{module}"), name))


def _of_module(tree: ast.Module) -> Iterator[tuple[str, str]]:
    for k, statement in enumerate(tree.body):
        if not isinstance(statement, ast.Assign) or not _is_number(statement.value):
            continue
        target = statement.targets[0]
        if isinstance(target, ast.Name) and target.id.isupper():
            beside = tree.body[k + 1] if k + 1 < len(tree.body) else None
            yield target.id, _first_sentence(beside)


def _is_number(node: ast.expr) -> bool:
    plain = (ast.Constant, ast.operator, ast.unaryop, ast.BinOp, ast.UnaryOp)
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int | float)
    return isinstance(node, ast.UnaryOp | ast.BinOp) and all(
        isinstance(part, plain) for part in ast.walk(node)
    )


def _first_sentence(beside: ast.stmt | None) -> str:
    if not (isinstance(beside, ast.Expr) and isinstance(beside.value, ast.Constant)):
        return ""
    words = " ".join(str(beside.value.value).split()).replace("|", "/")
    return re.split(r"(?<=[.:;]) ", words, maxsplit=1)[0].rstrip(".:;")


def main() -> None:
    """Rewrites the rows of the table, by module."""
    text, known, numbers = METHOD.read_text(encoding="utf-8"), rows(), named_numbers()
    others = {key for key in known if not key[0].startswith(tuple(_dotted()))}
    lines = [
        f"| `{module}.{name}` | {value_of(module, name):g} | "
        f"{known.get((module, name), (0.0, ''))[1].strip() or numbers[module, name]} |"
        for module, name in sorted({*others, *numbers})
    ]
    first, last = text.index("| name | value |"), [m.end() for m in ROW.finditer(text)][-1]
    head = "| name | value | why |\n| --- | --- | --- |\n"
    METHOD.write_text(text[:first] + head + "\n".join(lines) + text[last:], encoding="utf-8")


def _dotted() -> list[str]:
    return [package.replace("/", ".") + "." for package in PACKAGES]


if __name__ == "__main__":
    main()
