"""Every package that a file imports is one that pyproject.toml names, each with a lower bound; and
every text that tells how to install FlexGUI names FlexGUI."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from flexgui.core.sentences import install_command

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
PINNED = {
    normal.group()
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    if (normal := re.match(r"[\w.-]+", line.lower().replace("_", "-")))
}
FOR_USERS = ("page", "cluster", "control", "casadi", "lab")
"""Extras whose packages the program imports; the others are for tests."""
PAGE = ("page", "server", "scene", "session", "stages", "jobs")
"""Folders of flexgui that may import what only the page needs."""


def name_of(requirement: str) -> str:
    """`numpy` of `numpy>=2.1`."""
    found = re.match(r"[\w.-]+", requirement)
    assert found is not None
    return found.group().lower().replace("_", "-")


def declared(*extras: str) -> set[str]:
    """Packages that an installation with these extras brings."""
    lines = [*PROJECT["dependencies"], *(line for extra in extras for line in EXTRAS[extra])]
    return {name_of(line) for line in lines}


@cache
def imported(path: Path) -> list[str]:
    """Modules that a file imports, those inside functions too."""
    found: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            found.append(node.module)
    return found


distributions = cache(packages_distributions)


def packages(folder: Path) -> dict[str, Path]:
    """Packages of others that files below a folder import -> one of the files."""
    homes, found = distributions(), {}
    for path in folder.rglob("*.py"):
        for top in {module.partition(".")[0] for module in imported(path)}:
            if top not in sys.stdlib_module_names | {"flexgui"}:
                found[name_of(homes.get(top, [top])[0])] = path
    return found


@pytest.mark.parametrize("folder", ["core", "flexgui"])
def test_what_is_imported_is_declared(folder: str) -> None:
    missing = packages(ROOT / folder).keys() - declared(*FOR_USERS)
    assert not missing


def test_only_the_page_imports_what_only_the_page_needs() -> None:
    only = declared("page") - declared()
    folders = [path for path in (ROOT / "flexgui").iterdir() if path.is_dir()]
    others = [path for path in folders if not path.is_symlink() and path.name not in PAGE]
    assert len(others) >= 3
    found = {str(path) for each in [*others, ROOT / "core"] for name, path in packages(each).items()
             if name in only}  # fmt: skip
    assert not found


def test_every_package_has_a_lower_bound_and_a_tested_version() -> None:
    lines = [*PROJECT["dependencies"], *(line for extra in EXTRAS.values() for line in extra)]
    others = [line for line in lines if not line.startswith(f"{PROJECT['name']}[")]
    assert [line for line in others if not re.search(r"[>=]=\d", line)] == []
    assert {name_of(line) for line in others} <= PINNED


def test_a_message_installs_an_extra_of_this_distribution_into_this_environment() -> None:
    for extra in EXTRAS:
        python, *words = install_command(extra).split()
        assert Path(python) == Path(sys.executable)
        assert words == ["-m", "pip", "install", f"'{PROJECT['name']}[{extra}]'"]


FOREIGN = re.compile(r"pip3? install[^\n&;|`]*[ '\"]flexgui(?![\w./-])|(?<![\w/-])flexgui\\?\[\w")
"""A command or a requirement with `flexgui`, which the package index has from others."""


def test_no_text_installs_the_foreign_distribution() -> None:
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    texts = {path: path.read_bytes().decode(errors="replace") for name in names.splitlines()
             if (path := ROOT / name).is_file() and path.suffix != ".gz"}  # fmt: skip
    del texts[Path(__file__).resolve()]
    assert len(texts) > len(EXTRAS)
    found = {
        str(path): hit.group() for path, text in texts.items() if (hit := FOREIGN.search(text))
    }
    assert not found
