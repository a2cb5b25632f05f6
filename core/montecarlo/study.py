"""A study from beginning to end: its parts, their cases, who runs them, what was found before."""

from __future__ import annotations

import json
import time
from abc import ABC, abstractmethod
from collections.abc import Collection, Generator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from ..errors import InputError
from ..montecarlo.rig import Rig, rig_of
from ..montecarlo.settings import StudySettings
from ..plugins import discover
from ..processors import at_most
from ..resumable.executor import Executor, Here, Stop, never
from ..resumable.journal import Finished, Journal, resume
from ..sentences import did_you_mean


def study_cases(settings: StudySettings, only: Collection[str] = ()) -> list[Case]:
    """The cases of all parts, or of the named ones; InputError for a name that is none."""
    kinds = parts()
    for name in only:
        if name not in kinds:
            raise InputError(f"The study has no part {name!r}; {did_you_mean(name, kinds)}")
    chosen = [part for kind, part in kinds.items() if not only or kind in only]
    return [case for part in chosen for case in part.cases(settings)]


def study(
    settings: StudySettings,
    *,
    executor: Executor | None = None,
    path: Path | None = None,
    only: Collection[str] = (),
    stop: Stop = never,
) -> Generator[Finished, None, None]:
    """Yields every case once, as `resume` does; `path` is the file that keeps what is found."""
    journal = None if path is None else Journal(path, settings.identity)
    cases, order = study_cases(settings, only), partial(order_text, settings)
    return resume(cases, order, answer_text, executor or Here(), journal, stop)


FOLDER = f"{__package__}.parts"


def parts() -> dict[str, Part]:
    """kind -> part, in their order."""
    parts: dict[str, Part] = discover(FOLDER, Part)
    return dict(sorted(parts.items(), key=lambda pair: pair[1].order))


def order_text(settings: StudySettings, case: Case) -> str:
    """What a worker is sent."""
    order = {"settings": settings.model_dump_json(), "part": case.part, "key": case.key}
    return json.dumps({**order, "options": dict(case.options)})


def answer_text(order: str) -> str:
    """The record of one case: `answer` is what it found, `seconds` what it took."""
    request: dict[str, Any] = json.loads(order)
    start = time.perf_counter()
    with at_most(1):
        answer = parts()[request["part"]].run(rig_of(request["settings"]), request["options"])
    seconds = time.perf_counter() - start
    record = {"key": request["key"], "part": request["part"], "answer": answer, "seconds": seconds}
    return json.dumps(record, allow_nan=False)


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
