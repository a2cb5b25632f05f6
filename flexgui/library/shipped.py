"""The scenarios that come with FlexGUI, by name, and those that a page begins with."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from pathlib import Path

from flexgui.core.errors import InputError
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import Scenario
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


DEMO = "demo"
HIDDEN = "something hidden"


@cache
def demo_scenario() -> Scenario:
    """The scenario that the page starts with; it needs no file."""
    text = files("flexgui").joinpath("demo.toml").read_text(encoding="utf-8")
    return parse_scenario(text, "demo.toml")


@cache
def hidden_scenario() -> Scenario:
    """The scenario of the tour: an effect is in its recordings that its model lacks."""
    text = files("flexgui").joinpath("hidden.toml").read_text(encoding="utf-8")
    return parse_scenario(text, "hidden.toml")


def is_of_tour(scenario: Scenario) -> bool:
    """Whether its recordings are those of the tour, whatever was done to the model since."""
    return scenario.recordings == hidden_scenario().recordings


def is_as_begun(scenario: Scenario) -> bool:
    """Whether its recordings are those of one that a page begins with."""
    return any(scenario.recordings == made().recordings for made in EMBEDDED.values())


EMBEDDED = {DEMO: demo_scenario, HIDDEN: hidden_scenario}


@cache
def scenario_choices() -> dict[str, Path | None]:
    """Name -> file; None for those of the page itself."""
    return dict.fromkeys(EMBEDDED) | {name: scenario_path(name) for name in scenarios()}
