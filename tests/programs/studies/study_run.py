"""The cases of a study on a few processes, and what its command line takes and says."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

from flexgui.core.processors import WORKERS, at_most
from flexgui.core.resumable.executor import Work
from flexgui.core.resumable.journal import Journal, Keyed, Record, resume
from flexgui.jobs.executor import Processes

C = TypeVar("C", bound=Keyed)


def print_line(text: str) -> None:
    """One line, at once."""
    print(text, flush=True)


def run_all(
    cases: Sequence[C],
    work: Work,
    path: Path,
    told: Callable[[str], None] = print_line,
    processes: int = WORKERS,
) -> dict[str, Record]:
    """Runs the cases (dataclasses) that the file does not hold yet; the records of all of them.

    Ctrl-C ends it with what is finished; the next call goes on from there.
    """
    executor, journal = Processes(processes, "--processes"), Journal(path)
    left = sum(case.key not in journal.records for case in cases)
    told(f"{len(cases)} cases, {len(cases) - left} of them finished before.")
    begun = time.monotonic()
    try:
        with closing(resume(cases, order_text, work, executor, journal)) as steps:
            for number, step in enumerate((s for s in steps if not s.before), start=1):
                told(f"{number}/{left} {step.record['key']}{_time_left(begun, number, left)}")
    except KeyboardInterrupt:
        told("Stopped; the same command continues from here.")
    return finished(cases, path)


def finished(cases: Sequence[C], path: Path) -> dict[str, Record]:
    """key -> record of those of the cases that a file holds."""
    have = Journal(path).records
    return {case.key: have[case.key] for case in cases if case.key in have}


def order_text(case: Keyed) -> str:
    """What a worker is sent."""
    return json.dumps(asdict(case))  # type: ignore[call-overload]


def record_text(order: str, kind: Callable[..., C], run: Callable[[C], Record]) -> str:
    """The record, as text, of the case that a worker is sent; `kind` makes it of its fields."""
    case = kind(**json.loads(order))
    with at_most(1):
        return json.dumps(kept(case, run))


def kept(case: C, run: Callable[[C], Record]) -> Record:
    """What a case gave; a case that failed is a result too, and counts as one."""
    try:
        return run(case)
    except Exception as error:
        return {"key": case.key, "failed": f"{type(error).__name__}: {error}"}


def _time_left(begun: float, done: int, total: int) -> str:
    minutes = (time.monotonic() - begun) / done * (total - done) / 60.0
    return f", about {minutes:.0f} min left" if minutes >= 1.0 else ""


def study_parser(study: str, out: Path) -> argparse.ArgumentParser:
    """Of `python -m tests.programs.studies.<study>`, with the options that every study has."""
    parser = argparse.ArgumentParser(prog=f"python -m tests.programs.studies.{study}")
    parser.add_argument("--out", type=Path, default=out, help=f"results; {out} by default")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--tables", action="store_true", help="only print what is there")
    return parser


def run_study(
    cases: Sequence[C],
    work: Work,
    tables: Callable[[Sequence[Record]], str],
    asked: argparse.Namespace,
) -> int:
    """Runs the cases as the options of `study_parser` ask and prints the tables; 0."""
    if asked.tables:
        records = finished(cases, asked.out)
    else:
        records = run_all(cases, work, asked.out, processes=asked.workers)
    print_line(tables(list(records.values())))
    return 0
