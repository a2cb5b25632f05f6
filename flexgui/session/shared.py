"""What is made from a scenario, once for all sessions: in a class many have the same arm."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, Generic, TypeVar

import msgspec

from core.model import Model
from core.scenario.read import check_scenario, scenario_toml
from core.scenario.schema import Scenario
from core.workbench import base_model

V = TypeVar("V")

MOST = 64
"""Entries of each kind: twice the browsers of a class. The largest, a live model, has 100 KB."""


class Recent(Generic[V]):
    """What was used last, by key; the oldest goes first. Thread-safe."""

    def __init__(self, most: int = MOST) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._known: OrderedDict[Hashable, V] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], V]) -> V:
        """What is known, else what `make` gives; of two who make it at once both get one."""
        with self._lock:
            if key in self._known:
                self._known.move_to_end(key)
                return self._known[key]
        made = make()
        with self._lock:
            made = self._known.setdefault(key, made)
            while len(self._known) > self._most:
                self._known.popitem(last=False)
        return made


_SCENARIOS: Recent[Scenario] = Recent()
_MODELS: Recent[tuple[Scenario, Model]] = Recent()
_TEXTS: Recent[tuple[Scenario, str]] = Recent()
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
