"""Functions of one shape, alike but for names and values.

`python -m tests.programs.lint.duplicates`.
"""

from __future__ import annotations

import ast
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
LEAST = 50
"""Nodes of a syntax tree, some eight lines: smaller ones are alike because Python is."""
ALIKE = {
    frozenset(
        {
            "core/sensors/encoder.py channels",
            "core/sensors/link_encoder.py channels",
            "core/sensors/motor_torque.py channels",
        }
    ): "three sensors of the joints, each to be read in its own file",
}
"""Functions -> why they may have one shape."""


class Shape(ast.NodeTransformer):
    """Takes names and values out of a tree."""

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Any name."""
        return ast.Name("x", ast.Load())

    def visit_arg(self, node: ast.arg) -> ast.AST:
        """Any argument, whatever its type."""
        return ast.arg("x")

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        """Any value."""
        return ast.Constant(0)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """Any attribute."""
        self.generic_visit(node)
        node.attr = "a"
        return node

    def visit_keyword(self, node: ast.keyword) -> ast.AST:
        """Any keyword."""
        self.generic_visit(node)
        node.arg = "k" if node.arg else None
        return node


def shape(function: ast.FunctionDef) -> str:
    """Of a function's body without its docstring; empty where it is short."""
    body = function.body[1:] if ast.get_docstring(function) else function.body
    if sum(1 for part in body for _ in ast.walk(part)) < LEAST:
        return ""
    tree = ast.parse(ast.unparse(ast.Module(body, [])))
    return ast.dump(Shape().visit(tree))


def functions(paths: Sequence[Path]) -> Iterator[tuple[str, ast.FunctionDef]]:
    """(file:name, function) of all that are in the files, methods and inner ones too."""
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", node


def duplicates(paths: Sequence[Path]) -> list[list[str]]:
    """Groups of functions with one shape."""
    groups: dict[str, list[str]] = defaultdict(list)
    for name, function in functions(paths):
        groups[shape(function)].append(name)
    groups.pop("", None)
    found = [group for group in groups.values() if len(group) > 1]
    return [group for group in found if frozenset(map(_unplaced, group)) not in ALIKE]


def _unplaced(name: str) -> str:
    """`core/x.py f`: a line number says nothing for long."""
    place, _, own = name.partition(" ")
    return f"{place.partition(':')[0]} {own}"


def main() -> int:
    """Print the groups; 1 where there are any."""
    found = duplicates(
        sorted(p for package in ("core", "flexgui") for p in (ROOT / package).rglob("*.py"))
    )
    print("\n".join(" ~ ".join(group) for group in found) or "No functions of one shape.")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
