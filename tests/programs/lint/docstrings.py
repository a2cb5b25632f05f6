"""What the docstrings of public functions leave open, read from their signatures.

`python -m tests.programs.lint.docstrings [folder ...]` lists, of each public function,

- arrays (arguments and results) without a shape,
- numbers (arguments and results) without a unit or a kind,
- errors that it raises and does not name.

An argument is described in the section `Args`, or in the sentence that has its name.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
SHAPE = re.compile(r"\([^()]*(?:\([^()]*\))?[^()]*,[^()]*\)|\bshapes?\b|\bscalars?\b")
"""(N,), (N, k), (R, 2 (n + 1)) or what is shaped like something else."""
UNIT = re.compile(
    r"(?<!['’])\b(?:s|ms|µs|min|h|Hz|kHz|rad|mrad|rad/s|deg|m|mm|cm|µm|m/s|m/s²|kg|g|kg m²?|"
    r"N(?!,)|Nm|N m|N/m|V|A(?! [a-z])|W|J|Pa|GPa|dB|MB|px|SI|(?i:seconds?|minutes?|degrees?|bytes?|"
    r"pixels?|samples?|units?|no unit|"
    r"unitless|dimensionless|per cent|%|relative|ratios?|factors?|shares?|fractions?|"
    r"probabilit(?:y|ies)|p-values?|quantiles?|multiples?|"
    r"times|between 0 and 1|criterion|from 0|0 to 1|cost|deviations?|floors?|cosines?|"
    r"correlations?|squared?|logarithm|bits|nats|slope|correlation|chance|sum|exponent))\b|%"
)


@dataclass(frozen=True)
class Asked:
    """One fact that a docstring owes."""

    fact: str
    """shape, unit or error"""
    where: str
    what: str
    said: bool


def asked(name: str, node: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[Asked]:
    """What the docstring of a function owes, and whether it says it."""
    text = inspect.cleandoc(ast.get_docstring(node) or "")
    for argument in [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]:
        kind = _kind(argument.annotation)
        if kind:
            said = _PATTERN[kind].search(entry(text, argument.arg))
            yield Asked(kind, name, argument.arg, said is not None)
    kind = _kind(node.returns)
    if kind:
        yield Asked(kind, name, "result", bool(_PATTERN[kind].search(result(text))))
    for error in sorted(raised(node)):
        yield Asked("error", name, error, error in text)


_PATTERN = {"shape": SHAPE, "unit": UNIT}


def _kind(annotation: ast.expr | None) -> str:
    """shape of an array, unit of a number, and nothing of anything else."""
    text = ast.unparse(annotation) if annotation else ""
    if re.fullmatch(r"(np\.ndarray|Array|NDArray\[.*\])( \| None)?", text):
        return "shape"
    return "unit" if re.fullmatch(r"float( \| None)?", text) else ""


def entry(text: str, argument: str) -> str:
    """What a docstring has on an argument: its entry of Args, else the sentences with its name."""
    found = re.search(rf"^ +\*?{argument}: (.*(?:\n {{8,}}.*)*)", text, re.MULTILINE)
    if found:
        return found[1]
    parts = re.split(r"(?<=[.;])\s+|(?<=[^`]:)\s+", text.split("\nArgs:")[0])
    return " ".join(p for p in parts if re.search(rf"\b{argument}\b", p, re.IGNORECASE))


def result(text: str) -> str:
    """What a docstring has on the result: its section Returns, else all but the arguments."""
    if "Returns:" in text:
        return text.split("Returns:")[1].split("Raises:")[0]
    return re.sub(r"\bArgs:.*?(?=\n\S|\Z)", "", text, flags=re.DOTALL)


def raised(node: ast.AST) -> set[str]:
    """Classes of the errors that the function itself raises by name, and does not catch. A command
    ends by Exit; its docstring, which is its help, has the codes."""
    found = set()
    for inner in ast.walk(node):
        if isinstance(inner, ast.Raise) and isinstance(inner.exc, ast.Call):
            error = ast.unparse(inner.exc.func).rpartition(".")[2]
            if error[:1].isupper() and error not in ("NotImplementedError", "Exit"):
                found.add((error, inner))
    caught = {
        (error, each)
        for inner in ast.walk(node)
        if isinstance(inner, ast.Try)
        for error, each in found
        if any(each in ast.walk(part) for part in inner.body)
        and any(error in ast.unparse(h.type) for h in inner.handlers if h.type)
    }
    return {error for error, _ in found - caught}


def public(tree: ast.Module, module: str) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Public functions, and methods of public classes, that have a docstring of their own."""
    for node in tree.body:
        if not isinstance(node, (*FUNCTIONS, ast.ClassDef)) or node.name.startswith("_"):
            continue
        is_class = isinstance(node, ast.ClassDef)
        owner = f"{module}.{node.name}" if is_class else module
        for inner in node.body if is_class else [node]:
            own = isinstance(inner, FUNCTIONS) and ast.get_docstring(inner)
            if own and not inner.name.startswith("_"):
                yield f"{owner}.{inner.name}", inner


def facts(rooms: tuple[str, ...] = ("core", "flexgui")) -> list[Asked]:
    """All facts that the docstrings below some folders owe."""
    found = []
    for room in rooms:
        for path in sorted((ROOT / room).rglob("*.py")):
            if any(part.startswith("_") and part != "__init__.py" for part in path.parts):
                continue
            module = str(path.relative_to(ROOT).with_suffix("")).replace("/", ".")
            for name, node in public(ast.parse(path.read_text(encoding="utf-8")), module):
                found += asked(name, node)
    return found


def main() -> None:
    """Print the open facts, then the shares."""
    found = facts(tuple(sys.argv[1:]) or ("core", "flexgui"))
    for each in [a for a in found if not a.said]:
        print(f"{each.fact:6} {each.where}: {each.what}")
    for fact in ("shape", "unit", "error"):
        every = [a.said for a in found if a.fact == fact]
        print(f"{fact}: {sum(every)} of {len(every)}, {sum(every) / max(len(every), 1):.1%}")


if __name__ == "__main__":
    main()
