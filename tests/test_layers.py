"""Imports go one way, so that each part can be read without the parts above it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

RANKS = {
    "core": 0,
    "core.errors": 0,
    "core.sentences": 0.1,
    "core.files": 0.2,
    "core.quantities": 0.2,
    "core.units": 0.2,
    "core.validation": 0.2,
    "core.written": 0.2,
    "core.plugins": 0.2,
    "core.resumable": 0.3,
    "core.parameters": 1,
    "core.recording": 1,
    "core.results": 1,
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
    "core.warm": 8.6,
    "core.check": 8.7,
    "core.identify": 9,
    "core.diagnose": 10,
    "core.diagnosed": 10.5,
    "core.workbench": 11,
    "core.study": 12,
    "core.montecarlo": 12.5,
    "flexgui.plain_words": 13.5,
    "flexgui.views": 14,
    "flexgui.progress": 14,
    "flexgui.places": 14,
    "flexgui.kept_files": 14,
    "flexgui.stage": 14.5,
    "flexgui.export": 15,
    "flexgui.jobs": 15.5,
    "flexgui.session": 16,
    "flexgui.panels": 16.5,
    "flexgui.page": 17,
    "flexgui.server": 17.5,
    "flexgui.bench": 17.5,
    "flexgui.challenge": 17.5,
    "flexgui.grade": 17.5,
    "flexgui.study": 17.5,
    "flexgui.library": 17.6,
    "flexgui.reference": 17.7,
    "flexgui.check": 17.5,
    "flexgui.cli": 18,
    "flexgui.__main__": 19,
    "flexgui": 20,
}
"""A module may import what ranks lower, and its own package. The longest prefix counts. `flexgui`
itself is the public face: it names what lies below and imports it when it is first used."""

CORE_NEVER = {"flexgui", "viser", "plotly", "typer", "rich", "jinja2"}
VIEWS_NEVER = {"viser", "typer", "jinja2"}


def modules() -> list[Path]:
    return sorted(p for room in ("core", "flexgui") for p in (ROOT / room).rglob("*.py"))


def dotted(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(path: Path) -> Iterator[str]:
    """Full names of all that a file imports, inside functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def room(name: str) -> str:
    """The longest ranked prefix of a dotted name."""
    parts = name.split(".")
    return next(
        prefix for end in range(len(parts), 0, -1) if (prefix := ".".join(parts[:end])) in RANKS
    )


@pytest.mark.parametrize("path", modules(), ids=dotted)
def test_imports_go_down(path: Path) -> None:
    own = room(dotted(path))
    ours = {name for name in imports(path) if name.split(".")[0] in ("core", "flexgui")}
    upward = {name for name in ours if room(name) != own and RANKS[room(name)] >= RANKS[own]} - {
        "flexgui.__version__"
    }
    assert not upward, f"{dotted(path)} (in {own}) imports upwards: {sorted(upward)}"


@pytest.mark.parametrize("path", modules(), ids=dotted)
def test_every_module_has_a_room(path: Path) -> None:
    assert room(dotted(path)) not in {"core", "flexgui"} or path.name == "__init__.py", (
        f"{dotted(path)} stands in no room of RANKS; give it a rank"
    )


@pytest.mark.parametrize("path", modules(), ids=dotted)
def test_imports_are_absolute(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert not [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.level]


@pytest.mark.parametrize("path", modules(), ids=dotted)
def test_core_has_no_user_interface_and_views_have_no_viewer(path: Path) -> None:
    outside = {name.split(".")[0] for name in imports(path)}
    name = dotted(path)
    if name.startswith("core"):
        assert not outside & CORE_NEVER
    if name.startswith("flexgui.views"):
        assert not outside & VIEWS_NEVER


@pytest.mark.parametrize("path", modules(), ids=dotted)
def test_nothing_is_pickled_or_evaluated(path: Path) -> None:
    forbidden = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib"}
    assert not {name.split(".")[0] for name in imports(path)} & forbidden
    called = {
        node.func.id
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    assert not called & {"eval", "sympify", "parse_expr"}
