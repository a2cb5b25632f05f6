"""Cases to their end: what is known already, then what is found, each kept before it is told."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass
from typing import Protocol, TypeVar

from core.resumable.executor import Executor, Stop, Work, never
from core.resumable.journal import Journal, Record


class Keyed(Protocol):
    """A case: one piece of work, independent of all others."""

    @property
    def key(self) -> str:
        """Names its result."""


C = TypeVar("C", bound=Keyed)


@dataclass(frozen=True)
class Finished:
    """One case is done."""

    record: Record
    done: int
    total: int
    before: bool
    """Whether an earlier run had found it."""


def go_on(
    cases: Sequence[C],
    order: Callable[[C], str],
    work: Work,
    executor: Executor,
    journal: Journal | None = None,
    stop: Stop = never,
) -> Generator[Finished, None, None]:
    """Yields every case once: first what the journal holds, then the others as they come.

    `order` writes down what `work` needs to know of a case. What comes is in the journal before it
    is yielded. `stop` is asked several times a second; closing the generator stops too. The same
    call goes on where it stopped.
    """
    known = journal.records if journal is not None else {}
    before = [known[case.key] for case in cases if case.key in known]
    open_cases = [case for case in cases if case.key not in known]
    for done, record in enumerate(before, start=1):
        yield Finished(record, done, len(cases), True)
    if not open_cases or stop():
        return
    answers = executor.answers(work, [order(case) for case in open_cases], stop)
    with (
        closing(answers),
        journal.writing() if journal is not None else nullcontext() as writer,
    ):
        for done, (_, text) in enumerate(answers, start=len(before) + 1):
            if writer is not None:
                writer.line(text)
            yield Finished(json.loads(text), done, len(cases), False)


def records_of(steps: Iterable[Finished]) -> dict[str, Record]:
    """key -> record when all is done, in the order in which they came."""
    return {step.record["key"]: step.record for step in steps}
