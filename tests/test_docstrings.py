"""Every public name says what it is, in its own docstring or in that of the contract it fulfils."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Iterator
from functools import cache

import pytest

from tests.programs.lint.docstrings import Asked, asked, facts
from tests.test_layers import trees

FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def undocumented(name: str, tree: ast.Module) -> Iterator[str]:
    """Public classes, functions and methods without a docstring of their own."""
    for node in tree.body:
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)) and not node.name.startswith("_"):
            if not ast.get_docstring(node):
                yield f"{name}.{node.name}"
            for inner in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(inner, FUNCTIONS) and _lacks_one(inner):
                    yield f"{name}.{node.name}.{inner.name}"


def _lacks_one(method: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """A setter's docstring is its property's."""
    setter = any(isinstance(d, ast.Attribute) and d.attr == "setter" for d in method.decorator_list)
    return not (method.name.startswith("_") or setter or ast.get_docstring(method))


def inherits_its_docstring(name: str) -> bool:
    """Whether a method fulfils a contract that says what it does."""
    module, _, rest = name.rpartition(".")
    module, _, owner = module.rpartition(".")
    if not owner[:1].isupper():
        return False
    kind: type = getattr(importlib.import_module(module), owner)
    owners = (vars(base) for base in kind.__mro__[1:])
    return any(rest in owner and owner[rest].__doc__ for owner in owners)


@pytest.mark.parametrize("room", ["core", "flexgui"])
def test_every_public_name_has_a_docstring(room: str) -> None:
    found = [
        name
        for module, tree in trees().items()
        if module.split(".")[0] == room
        for name in undocumented(module, tree)
        if not inherits_its_docstring(name)
    ]
    assert not found, "\n".join(found)


def test_every_module_has_a_docstring() -> None:
    assert not [name for name, tree in trees().items() if not ast.get_docstring(tree)]


STATED = 0.95
"""Least share that is stated: some errors are a command's, whose docstring is its help."""


@cache
def owed() -> list[Asked]:
    """What signatures leave to docstrings."""
    return facts()


@pytest.mark.parametrize("fact", ["shape", "unit", "error"])
def test_docstrings_state_shapes_units_and_errors(fact: str) -> None:
    found = [each for each in owed() if each.fact == fact]
    unsaid = [f"{each.where}: {each.what}" for each in found if not each.said]
    assert len(unsaid) <= (1.0 - STATED) * len(found), "\n".join([f"no {fact}:", *unsaid])


OPEN = '''
def f(x: np.ndarray, dt: float) -> None:
    """Draws x{shape} every `dt`{unit}{error}."""
    try:
        raise KeyError(x)
    except KeyError:
        raise InputError(x) from None
'''


@pytest.mark.parametrize(
    ("fact", "shape", "unit", "error"),
    [("shape", "", " s", "; InputError"), ("unit", " (N,)", "", "; InputError"),
     ("error", " (N,)", " s", "")],
)  # fmt: skip
def test_a_fact_that_a_docstring_leaves_open_is_seen(
    fact: str, shape: str, unit: str, error: str
) -> None:
    def unsaid(text: str) -> list[str]:
        (node,) = ast.parse(text).body
        assert isinstance(node, ast.FunctionDef)
        return [each.fact for each in asked("f", node) if not each.said]

    assert unsaid(OPEN.format(shape=shape, unit=unit, error=error)) == [fact]
    assert not unsaid(OPEN.format(shape=" (N,)", unit=" s", error="; InputError"))


def test_a_method_without_a_docstring_is_seen() -> None:
    tree = ast.parse('class A:\n    """A."""\n    def f(self): ...\n    def _g(self): ...\n')
    assert list(undocumented("m", tree)) == ["m.A.f"]


def test_a_contract_speaks_for_those_who_fulfil_it() -> None:
    friction = "flexgui.core.effects.coulomb_friction.CoulombFriction"
    assert inherits_its_docstring(f"{friction}.parameters")
    assert not inherits_its_docstring(f"{friction}.nothing")
