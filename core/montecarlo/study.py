"""A study from beginning to end: its cases, who runs them, what was found before."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator
from contextlib import closing, nullcontext
from dataclasses import dataclass
from pathlib import Path

from core.errors import InputError
from core.montecarlo.executor import Executor, Stop, never
from core.montecarlo.journal import Journal, Record
from core.montecarlo.part import Case
from core.montecarlo.processes import Processes
from core.montecarlo.settings import StudySettings
from core.montecarlo.work import order_text, parts
from core.sentences import did_you_mean


@dataclass(frozen=True)
class Finished:
    """One case is done."""

    record: Record
    done: int
    total: int
    before: bool
    """Whether an earlier run of the study had found it."""


def study_cases(settings: StudySettings, only: Collection[str] = ()) -> list[Case]:
    """The cases of all parts, or of the named ones."""
    known = parts()
    for name in only:
        if name not in known:
            raise InputError(f"The study has no part {name!r}; {did_you_mean(name, known)}")
    chosen = [part for kind, part in known.items() if not only or kind in only]
    return [case for part in chosen for case in part.cases(settings)]


def study(
    settings: StudySettings,
    *,
    executor: Executor | None = None,
    path: Path | None = None,
    only: Collection[str] = (),
    on_result: Callable[[Finished], None] | None = None,
    stop: Stop = never,
) -> Iterator[Finished]:
    """Yields every case once: first what `path` holds already, then the others as they come.

    What comes is written to `path` before it is yielded. `stop` is asked several times a second;
    closing the iterator stops too. The same call goes on where it stopped.
    """
    cases = study_cases(settings, only)
    journal = Journal(path, settings.identity) if path is not None else None
    known = journal.records if journal is not None else {}
    before = [case for case in cases if case.key in known]
    open_cases = [case for case in cases if case.key not in known]
    done = 0

    def told(record: Record, old: bool) -> Finished:
        nonlocal done
        done += 1
        finished = Finished(record, done, len(cases), old)
        if on_result is not None:
            on_result(finished)
        return finished

    for case in before:
        yield told(known[case.key], True)
    if not open_cases or stop():
        return
    orders = [order_text(settings, case) for case in open_cases]
    answers = (executor or Processes()).answers(orders, stop)
    with (
        closing(answers),  # type: ignore[type-var]
        journal.writing() if journal is not None else nullcontext() as writer,
    ):
        for _, text in answers:
            record = json.loads(text)
            if writer is not None:
                writer.line(record)
            yield told(record, False)


def run_study(
    settings: StudySettings,
    *,
    executor: Executor | None = None,
    path: Path | None = None,
    only: Collection[str] = (),
    on_result: Callable[[Finished], None] | None = None,
    stop: Stop = never,
) -> dict[str, Record]:
    """The same to its end: key -> record, in the order of the cases."""
    steps = study(settings, executor=executor, path=path, only=only, on_result=on_result, stop=stop)
    found = {step.record["key"]: step.record for step in steps}
    keys = [case.key for case in study_cases(settings, only)]
    return {key: found[key] for key in keys if key in found}
