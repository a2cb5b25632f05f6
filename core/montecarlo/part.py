"""The contract of a part of a study."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from core.montecarlo.rig import Rig
from core.montecarlo.settings import StudySettings

Answer = dict[str, Any]
"""Numbers, texts, lists and tables of them: what JSON can hold exactly."""


@dataclass(frozen=True)
class Case:
    """One piece of work, independent of all others; `key` names its result."""

    part: str
    key: str
    options: Mapping[str, Any] = field(default_factory=dict)
    """What the part needs to know; as plain as an answer."""


class Part(ABC):
    """Which cases there are, and what one of them gives.

    A case is a function of the settings and its options alone: all its random numbers come from
    seeds that are made of them, so it gives the same numbers wherever and whenever it runs.
    """

    kind: ClassVar[str] = ""
    title: ClassVar[str] = ""
    order: ClassVar[int] = 0
    """Parts run in this order, where there is a choice."""

    @abstractmethod
    def cases(self, settings: StudySettings) -> tuple[Case, ...]:
        """All cases, in the order in which a person would like to see them."""

    @abstractmethod
    def run(self, rig: Rig, options: Mapping[str, Any]) -> Answer:
        """The numbers of one case."""
