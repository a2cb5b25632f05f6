"""A study from beginning to end: its cases, who runs them, what was found before."""

from __future__ import annotations

from collections.abc import Collection, Generator
from functools import partial
from pathlib import Path

from core.errors import InputError
from core.montecarlo.part import Case
from core.montecarlo.settings import StudySettings
from core.montecarlo.work import answer_text, order_text, parts
from core.resumable.executor import Executor, Stop, never
from core.resumable.going_on import Finished, go_on
from core.resumable.journal import Journal
from core.resumable.processes import Processes
from core.sentences import did_you_mean


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
    stop: Stop = never,
) -> Generator[Finished, None, None]:
    """Yields every case once, as `go_on` does; `path` is the file that keeps what is found."""
    journal = None if path is None else Journal(path, settings.identity)
    cases, order = study_cases(settings, only), partial(order_text, settings)
    return go_on(cases, order, answer_text, executor or Processes(), journal, stop)
