"""Changes of a scenario, a document that is changed and the whole checked again, and what is made
from a scenario, once for all sessions: in a class many have the same arm."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from flexgui.core.arm.build import build_arm
from flexgui.core.model import Model
from flexgui.core.recent import Recent
from flexgui.core.scenario.read import check_scenario, scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model

Document = dict[str, Any]
Edit = Callable[[Document], None]

SOURCE = "The scenario"
"""How messages name what the page changes."""

SECTION_PARAMETERS = {"young_modulus": "epsilon", "width": "d"}
"""A segment's setting and the parameter of [identify] that it starts."""


def edited(scenario: Scenario, *edits: Edit) -> Scenario:
    """The scenario after the edits, in order; InputError where the result is not a scenario."""
    document = thawed(scenario.model_dump(exclude_defaults=True))
    for edit in edits:
        edit(document)
    return scenario_of(document, SOURCE)


def thawed(value: Any) -> Any:
    """Tuples as lists, so that an edit may change entries."""
    if isinstance(value, dict):
        return {key: thawed(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [thawed(each) for each in value]
    return value


def put(path: Sequence[str | int], value: Any) -> Edit:
    """Sets one setting; tables on the way are made, None removes it."""

    def edit(document: Document) -> None:
        place: Any = document
        for key in path[:-1]:
            place = place.setdefault(key, {}) if isinstance(place, dict) else place[key]
        if value is None:
            place.pop(path[-1], None)
        else:
            place[path[-1]] = value

    return edit


def arm_setting(scenario: Scenario, name: str, value: Any) -> Edit:
    """Sets a segment's setting for all segments (a list: one each).

    Where epsilon or d have bounds these move with the value: they are meant around it.
    """
    before = getattr(build_arm(scenario.arm).segments[0], name)
    now = value[0] if isinstance(value, list) else value
    parameter = SECTION_PARAMETERS.get(name, "")

    def edit(document: Document) -> None:
        document["arm"][name] = value
        for table in document["arm"].get("segments", ()):
            table.pop(name, None)
        bounds = document.get("identify", {}).get("bounds", {})
        if parameter in bounds and before:
            bounds[parameter] = [end * now / before for end in bounds[parameter]]

    return edit


def recording(index: int, *path: str) -> tuple[str | int, ...]:
    """The path of a recording's setting."""
    return ("recordings", index, *path)


def noise_of_simulations(snr_db: float | None) -> Edit:
    """The same signal-to-noise ratio for every simulated recording; None: no noise."""

    def edit(document: Document) -> None:
        for entry in document.get("recordings", ()):
            if "simulate" in entry and "sweep" not in entry["simulate"]:
                put(("simulate", "snr_db"), snr_db)(entry)

    return edit


MOST = 64
"""Entries of each kind: twice the browsers of a class. The largest, a live model, has 100 KB."""


_SCENARIOS: Recent[Scenario] = Recent(MOST)
_MODELS: Recent[tuple[Scenario, Model]] = Recent(MOST)
_TEXTS: Recent[tuple[Scenario, str]] = Recent(MOST)
"""By the scenario's id, which is nobody else's while the entry holds it."""


def scenario_of(document: dict[str, Any], source: str) -> Scenario:
    """The scenario in a document of plain values, the same object for the same document."""
    try:
        written = msgspec.msgpack.encode(document)
    except (TypeError, ValueError, OverflowError):
        return check_scenario(document, source)  # which says what is none of its values
    key = (source, hashlib.blake2b(written).digest())
    return _SCENARIOS.get(key, lambda: check_scenario(document, source))


def model_of(scenario: Scenario) -> Model:
    """`base_model`; InputError where it is none."""
    return _MODELS.get(id(scenario), lambda: (scenario, base_model(scenario)))[1]


def text_of(scenario: Scenario) -> str:
    """`scenario_toml`"""
    return _TEXTS.get(id(scenario), lambda: (scenario, scenario_toml(scenario)))[1]
