"""What is made from a scenario, once for all sessions: in a class many have the same arm."""

from __future__ import annotations

import hashlib
from typing import Any

import msgspec

from core.model import Model
from core.recent import Recent
from core.scenario.read import check_scenario, scenario_toml
from core.scenario.schema import Scenario
from core.workbench import base_model

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
