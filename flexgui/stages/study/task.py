"""The cases and the report of a study, in a worker."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from flexgui.core.errors import InputError
from flexgui.core.montecarlo.settings import StudySettings, settings_of
from flexgui.core.resumable.executor import (
    POLL_INTERVAL,
    Answers,
    Executor,
    Stop,
    Work,
    never,
    requeue,
)
from flexgui.core.resumable.journal import Journal
from flexgui.jobs.job import QUEUED, Job
from flexgui.jobs.messages import Failed, Stopped, Task, WorkerLost
from flexgui.jobs.pool import JobPool

if TYPE_CHECKING:
    from flexgui.core.montecarlo.summary import Summary
    from flexgui.core.progress import Progress

JOURNAL = "results.jsonl"
"""Beside the report, as `flexgui study` has it: that command goes on in the same folder."""


def study_case(work: str, order: str, *, progress: Progress) -> str:
    """The record of the case that `order` states, both as text; `work` names who makes it."""
    record = Task(work).resolve()(order)
    assert isinstance(record, str)
    return record


def study_report(settings: str, folder: str, *, progress: Progress) -> str:
    """`write_report` in a worker; `settings` as JSON."""
    progress.stage("Writing the report of the study")
    write_report(settings_of(settings), Path(folder))
    return folder


def write_report(settings: StudySettings, folder: Path) -> Summary | None:
    """Page, tables and result of all that the journal in `folder` holds; None where it is empty."""
    from flexgui.core.montecarlo.summary import summarise
    from flexgui.stages.study.report import write_study

    records = Journal(folder / JOURNAL, settings.identity).records
    summary = summarise(settings, records) if records else None
    if summary is not None:
        write_study(summary, folder)
    return summary


class QueueExecutor(Executor):
    """Between two cases other sessions have their turn: the pool's queue is fair.

    At most `at_once` cases are under way, and at most one of them waits in the queue. What is under
    way when somebody stops may still end within the pool's patience, and then counts.
    """

    def __init__(self, pool: JobPool, session: str, at_once: int = 2) -> None:
        self._pool, self._session, self._at_once = pool, session, at_once
        self._news = threading.Event()

    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        tasks = [
            Task.of(study_case, "A case of the study", work=Task.name(work), order=order)
            for order in orders
        ]
        waiting, losses = deque(range(len(tasks))), Counter[int]()
        running: dict[int, Job] = {}
        try:
            while waiting or running:
                if stop():
                    waiting.clear()
                    _stop(running)
                self._submit(waiting, running, tasks)
                self._news.wait(POLL_INTERVAL)
                self._news.clear()
                yield from _collect(waiting, running, losses)
        finally:
            _stop(running)

    def _submit(self, waiting: deque[int], running: dict[int, Job], tasks: Sequence[Task]) -> None:
        while waiting and len(running) < self._at_once and not _queued(running):
            index = waiting.popleft()
            running[index] = self._pool.submit(
                self._session, tasks[index], lambda _: self._news.set()
            )


def _queued(running: dict[int, Job]) -> bool:
    return any(job.state.phase == QUEUED for job in running.values())


def _stop(running: dict[int, Job]) -> None:
    for job in running.values():
        job.stop()


def _collect(
    waiting: deque[int], running: dict[int, Job], losses: Counter[int]
) -> Iterator[tuple[int, str]]:
    """Answers that have come; a case whose worker died is done again."""
    for index, job in tuple(running.items()):
        if not job.over:
            continue
        del running[index]
        if isinstance(job.ending, Failed):
            raise InputError(job.ending.sentence)
        if isinstance(job.ending, WorkerLost):
            requeue(index, waiting, losses)
        if job.stop_requested_at is not None or isinstance(job.ending, Stopped):
            waiting.clear()  # whoever ended it wants no other one begun
        if job.result is not None:
            yield index, job.result
