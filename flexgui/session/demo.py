"""The scenarios that a person can pick: those of the page, and all that come with FlexGUI."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path

from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.library.shipped import scenario_path, scenarios

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


EMBEDDED = {DEMO: demo_scenario, HIDDEN: hidden_scenario}


@cache
def scenario_choices() -> dict[str, Path | None]:
    """Name -> file; None for those of the page itself."""
    return dict.fromkeys(EMBEDDED) | {name: scenario_path(name) for name in scenarios()}
