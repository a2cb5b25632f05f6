"""The scenarios that come with FlexGUI, by name."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from flexgui.core.errors import InputError
from flexgui.core.sentences import did_you_mean

ENDING = ".toml"
NO_SCENARIO = ("truth",)
"""Lies beside the recordings of the other engine and says what is hidden in them."""


def scenarios() -> dict[str, str]:
    """List the scenarios that come with FlexGUI.

    Returns:
        Name -> title. `flexgui.load(name)` and `flexgui export NAME` take the names; those of a
        real rig need recordings that are not part of FlexGUI (`data=`, `--data`).
    """
    import tomllib

    folder = shipped_folder()
    found = {}
    for path in sorted(folder.rglob(f"*{ENDING}")):
        name = path.relative_to(folder).with_suffix("").as_posix()
        if path.stem not in NO_SCENARIO:
            found[name] = str(tomllib.loads(path.read_text(encoding="utf-8"))["title"])
    return found


def scenario_path(given: str | Path) -> Path:
    """Find a scenario: a file, or by its name one that comes with FlexGUI.

    Args:
        given: A path, or a name from `scenarios()`. A file of that name wins.

    Returns:
        Its path; the path as given where it is neither a file nor a name.

    Raises:
        InputError: Where a plain word is neither; it names the nearest scenario.
    """
    path = Path(given)
    name = path.as_posix()
    if path.exists() or path.suffix or path.is_absolute() or ".." in path.parts:
        return path
    shipped = shipped_folder() / f"{name}{ENDING}"
    if path.name not in NO_SCENARIO and shipped.is_file():
        return shipped
    raise InputError(
        f"{name} is neither a file nor a scenario that comes with FlexGUI; "
        f"{did_you_mean(name, scenarios())}"
    )


def shipped_folder(name: str = "scenarios") -> Path:
    """Of the scenarios, the `examples` or the sheets for `teaching`: in an installed package;
    beside it in a checkout whose links could not be made."""
    package = Path(str(files("flexgui")))
    places = (package, package.parent, package.parent / "docs")
    return next(place / name for place in places if (place / name).is_dir())
