"""Edits of a scenario as a dictionary, checked as a whole afterwards; and caches, shared by all
sessions, of scenarios and models: in a class many have the same arm."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from flexgui.core.arm.build import build_arm
from flexgui.core.bounded_cache import BoundedCache
from flexgui.core.model import Model
from flexgui.core.scenario.read import check_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model

ScenarioDict = dict[str, Any]
Edit = Callable[[ScenarioDict], None]

SOURCE = "The scenario"
"""The name of the edited scenario in messages."""

SECTION_PARAMETERS = {"young_modulus": "epsilon", "width": "d"}
"""A segment's setting and the parameter of [identify] that it starts."""


def apply_edits(scenario: Scenario, *edits: Edit) -> Scenario:
    """The scenario after the edits, in order; InputError where the result is not a scenario."""
    document = with_lists(scenario.model_dump(exclude_defaults=True))
    for edit in edits:
        edit(document)
    return cached_scenario(document, SOURCE)


def with_lists(value: Any) -> Any:
    """Tuples as lists, so that an edit may change entries."""
    if isinstance(value, dict):
        return {key: with_lists(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [with_lists(each) for each in value]
    return value


def set_value(path: Sequence[str | int], value: Any) -> Edit:
    """Edit that sets one setting; missing tables are made, None removes the setting."""

    def edit(document: ScenarioDict) -> None:
        place: Any = document
        for key in path[:-1]:
            place = place.setdefault(key, {}) if isinstance(place, dict) else place[key]
        if value is None:
            place.pop(path[-1], None)
        else:
            place[path[-1]] = value

    return edit


def becoming(scenario: Scenario) -> Edit:
    """Edit that makes it another scenario."""

    def edit(document: ScenarioDict) -> None:
        document.clear()
        document.update(with_lists(scenario.model_dump(exclude_defaults=True)))

    return edit


def set_arm(scenario: Scenario, name: str, value: Any) -> Edit:
    """Edit that sets a segment's setting for all segments (a list: one value each).

    Bounds of epsilon or d are scaled with the value: they are meant around it.
    """
    before = getattr(build_arm(scenario.arm).segments[0], name)
    now = value[0] if isinstance(value, list) else value
    parameter = SECTION_PARAMETERS.get(name, "")

    def edit(document: ScenarioDict) -> None:
        document["arm"][name] = value
        for table in document["arm"].get("segments", ()):
            table.pop(name, None)
        bounds = document.get("identify", {}).get("bounds", {})
        if parameter in bounds and before:
            bounds[parameter] = [end * now / before for end in bounds[parameter]]

    return edit


def recording_path(index: int, *path: str) -> tuple[str | int, ...]:
    """The path of a recording's setting."""
    return ("recordings", index, *path)


def set_simulated_noise(snr_db: float | None) -> Edit:
    """The same `snr_db` in dB for every simulated recording; None: no noise."""

    def edit(document: ScenarioDict) -> None:
        for entry in document.get("recordings", ()):
            if "simulate" in entry and "sweep" not in entry["simulate"]:
                set_value(("simulate", "snr_db"), snr_db)(entry)

    return edit


def simulated_noise(scenario: Scenario, otherwise: float | None) -> float | None:
    """The signal-to-noise ratio in dB that this sets; `otherwise`: of no simulated recording."""
    simulated = (spec.simulate for spec in scenario.recordings)
    noise = [each.snr_db for each in simulated if each is not None and each.sweep is None]
    return noise[0] if noise else otherwise


CACHE_SIZE = 64
"""Entries of each kind: twice the browsers of a class. The largest, a live model, has 100 KB."""


_SCENARIOS: BoundedCache[Scenario] = BoundedCache(CACHE_SIZE)
_MODELS: BoundedCache[tuple[Scenario, Model]] = BoundedCache(CACHE_SIZE)
"""Keyed by the scenario's id, which stays unique while the entry holds the scenario."""


def cached_scenario(document: dict[str, Any], source: str) -> Scenario:
    """The checked scenario of a dictionary; the same object for equal dictionaries."""
    try:
        written = msgspec.msgpack.encode(document)
    except (TypeError, ValueError, OverflowError):
        return check_scenario(document, source)  # raises an InputError that names the value
    key = (source, hashlib.blake2b(written).digest())
    return _SCENARIOS.get(key, lambda: check_scenario(document, source))


def cached_model(scenario: Scenario) -> Model:
    """`base_model` of the scenario; InputError where it has no valid model."""
    return _MODELS.get(id(scenario), lambda: (scenario, base_model(scenario)))[1]
