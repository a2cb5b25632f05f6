"""Imports go one way, so that each part can be read without the parts above it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

RANKS = {
    "core": 0,
    "core.errors": 0,
    "core.processors": 0.05,
    "core.sentences": 0.1,
    "core.field_texts": 0.15,
    "core.files": 0.2,
    "core.units": 0.2,
    "core.validation": 0.2,
    "core.plugins": 0.2,
    "core.bounded_cache": 0.2,
    "core.resumable": 0.3,
    "core.parameters": 1,
    "core.recording": 1,
    "core.results": 1,
    "core.least_squares": 1.5,
    "core.compiler": 1.5,
    "core.progress": 2,
    "core.excitation": 2,
    "core.lanes": 2.5,
    "core.arm": 3,
    "core.drives": 4,
    "core.trajectory": 4.2,
    "core.sensors": 4.5,
    "core.forces": 4.8,
    "core.effects": 5,
    "core.model": 6,
    "core.scenario": 7,
    "core.simulate": 8,
    "core.loading": 8.5,
    "core.precompile": 8.6,
    "core.identify": 9,
    "core.noise": 9.5,
    "core.check": 9.6,
    "core.estimate": 9.7,
    "core.vibration_lines": 9.8,
    "core.missing_torque": 9.8,
    "core.error_maps": 9.8,
    "core.residual_analysis": 9.8,
    "core.information_criteria": 9.8,
    "core.diagnose": 10,
    "core.linear_or_nonlinear": 10.3,
    "core.propose": 10.2,
    "core.diagnosed_scenario": 10.5,
    "core.scenario_fits": 10.8,
    "core.profile_likelihood": 10.9,
    "core.workbench": 11,
    "core.experiments": 11.5,
    "core.challenge": 12,
    "core.montecarlo": 12.5,
    "flexgui.plain_words": 13.5,
    "flexgui.library.shipped": 13.6,
    "flexgui.sentences": 13.8,
    "flexgui.views": 14,
    "flexgui.progress": 14,
    "flexgui.places": 14,
    "flexgui.scene": 14.5,
    "flexgui.export": 15,
    "flexgui.jobs": 15.5,
    "flexgui.session": 15.8,
    "flexgui.stages": 16,
    "flexgui.session.session": 16.2,
    "flexgui.page": 16.5,
    "flexgui.page.page": 17,
    "flexgui.server": 17.5,
    "flexgui.stages.study.command": 17.5,
    "flexgui.library": 17.6,
    "flexgui.reference": 17.7,
    "flexgui.cli": 18,
    "flexgui.__main__": 19,
    "flexgui": 20,
}
"""A module may import what ranks lower, and its own package. The longest prefix counts. `flexgui`
itself is the public face: it names what lies below and imports it when it is first used."""

PARTS = {"edited_scenario", "playback", "replaced_work", "saved_work", "tour"}
"""Files of `flexgui/session` that know the stages."""

CORE_NEVER = {"flexgui", "viser", "plotly", "typer", "rich", "jinja2"}
VIEWS_NEVER = {"viser", "typer", "jinja2"}
PICKLERS = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib"}
EVALUATORS = {"eval", "sympify", "parse_expr"}


def modules() -> list[Path]:
    return sorted(p for room in ("core", "flexgui") for p in (ROOT / room).rglob("*.py"))


def dotted(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(tree: ast.Module, name: str) -> Iterator[str]:
    """Full names of all that a file imports, inside functions too, but for types only; `core` by
    its folder."""
    for node in _nodes(tree):
        if isinstance(node, ast.Import):
            yield from (a.name.replace("flexgui.core.", "core.") for a in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = folder_of(name).split(".")
            above = above[: len(above) - node.level + 1] if node.level else []
            start = ".".join([*above, *filter(None, [node.module])])
            yield from (f"{start}.{a.name}".replace("flexgui.core.", "core.") for a in node.names)


def _nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """All below, without `if TYPE_CHECKING`."""
    for node in ast.iter_child_nodes(tree):
        if not (isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"):
            yield node
            yield from _nodes(node)


def folder_of(name: str) -> str:
    """The package that a module lies in; a package lies in itself."""
    is_package = (ROOT / name.replace(".", "/") / "__init__.py").exists()
    return name if is_package else name.rpartition(".")[0]


@cache
def trees() -> dict[str, ast.Module]:
    """Each file is read once, where it is needed: a test per file and rule took longer to list than
    to run."""
    return {dotted(path): ast.parse(path.read_text(encoding="utf-8")) for path in modules()}


@cache
def imports_of(name: str) -> frozenset[str]:
    return frozenset(imports(trees()[name], name))


def room(name: str) -> str:
    """The longest ranked prefix of a dotted name; panels are of the page, what a session is made of
    stands with it."""
    parts = name.split(".")
    if parts[:2] == ["flexgui", "stages"] and parts[3:] and parts[3].startswith("panel"):
        return "flexgui.page"
    if parts[:2] == ["flexgui", "session"] and parts[2:3] and parts[2] in PARTS:
        return "flexgui.session.session"
    return next(
        prefix for end in range(len(parts), 0, -1) if (prefix := ".".join(parts[:end])) in RANKS
    )


def upward(name: str) -> set[str]:
    """What a module imports from a higher room, or from another one as high."""
    own = room(name)
    ours = {each for each in imports_of(name) if each.split(".")[0] in ("core", "flexgui")}
    found = {each for each in ours if room(each) != own and RANKS[room(each)] >= RANKS[own]}
    return found - {"flexgui.__version__"}


def outside(name: str) -> set[str]:
    """The packages that a module imports from."""
    return {each.split(".")[0] for each in imports_of(name)}


def calls(tree: ast.Module) -> set[str]:
    """Names of the functions that a file calls by their bare name."""
    called = (node.func for node in ast.walk(tree) if isinstance(node, ast.Call))
    return {each.id for each in called if isinstance(each, ast.Name)}


def test_imports_go_down() -> None:
    assert {"core.workbench", "flexgui.cli"} <= set(trees()), "there is something to look at"
    found = {name: sorted(upward(name)) for name in trees() if upward(name)}
    assert not found, f"these import upwards: {found}"


def test_no_module_needs_itself() -> None:
    """What is imported when a module is imported never comes back to it."""
    known = trees()
    needs = {
        name: {
            module
            for each in imports(tree, name)
            for module in (each, each.rpartition(".")[0])
            if module in known and module != name
        }
        for name, tree in ((name, _outside_functions(tree)) for name, tree in known.items())
    }
    TopologicalSorter(needs).prepare()


def _outside_functions(tree: ast.Module) -> ast.Module:
    plain = (n for n in tree.body if not isinstance(n, ast.FunctionDef | ast.ClassDef))
    return ast.Module(list(plain), [])


def test_every_module_has_a_room() -> None:
    packages = {dotted(path) for path in modules() if path.name == "__init__.py"}
    lost = [name for name in trees() if room(name) in {"core", "flexgui"} and name not in packages]
    assert not lost, f"these stand in no room of RANKS; give them a rank: {lost}"


def test_imports_are_absolute_but_in_core_which_is_called_flexgui_core_where_it_is_used() -> None:
    def levels(tree: ast.Module) -> set[bool]:
        ours = ("core", "flexgui")
        nodes = [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
        return {n.level > 0 for n in nodes if n.level or (n.module or "").split(".")[0] in ours}

    found = {name: levels(tree) for name, tree in trees().items()}
    assert not {n for n, relative in found.items() if (n.split(".")[0] != "core") in relative}
    plain = {n for n, tree in trees().items() if any(_names_core(node) for node in ast.walk(tree))}
    assert not plain, "an installed `core` is in everybody's way; write flexgui.core"


def _names_core(node: ast.AST) -> bool:
    if isinstance(node, ast.Import):
        return any(alias.name.split(".")[0] == "core" for alias in node.names)
    return (
        isinstance(node, ast.ImportFrom)
        and (node.module or "").split(".")[0] == "core"
        and not node.level
    )


def test_core_has_no_user_interface_and_views_have_no_viewer() -> None:
    never = {"core": CORE_NEVER, "flexgui.views": VIEWS_NEVER}
    found = {
        name: forbidden & outside(name)
        for start, forbidden in never.items()
        for name in trees()
        if name.startswith(start) and forbidden & outside(name)
    }
    assert not found


def test_nothing_is_pickled_or_evaluated() -> None:
    assert not {name: outside(name) & PICKLERS for name in trees() if outside(name) & PICKLERS}
    found = {name: calls(tree) & EVALUATORS for name, tree in trees().items()}
    assert not {name: called for name, called in found.items() if called}
