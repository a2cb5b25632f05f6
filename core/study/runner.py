"""Many independent cases on a few processes, one line of JSON per finished case."""

from __future__ import annotations

import json
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from core.errors import InputError

PROCESSES = 2
"""The machines that this is meant for have two cores."""

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

AHEAD = 2
"""Cases that wait per process: few, so that stopping is quick."""

Record = dict[str, Any]
Work = Callable[[Any], Record]


def finished(path: Path) -> dict[str, Record]:
    """key -> record of all that a file holds; a last line that was cut off is left out."""
    if not path.exists():
        return {}
    found = {}
    try:
        for line in path.read_text(encoding="utf-8").splitlines():
            record = _record(line)
            if record is not None:
                found[record["key"]] = record
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read; give another file for the results.") from error
    return found


def _record(line: str) -> Record | None:
    try:
        found = json.loads(line)
    except json.JSONDecodeError:
        return None
    return found if isinstance(found, dict) and "key" in found else None


def run_all(
    cases: Sequence[Any],
    work: Work,
    path: Path,
    told: Callable[[str], None] = print,
    processes: int = PROCESSES,
    begin: Callable[[], None] | None = None,
) -> dict[str, Record]:
    """Runs the cases (with a `key`) that the file does not hold yet; the records of all of them.

    `begin` is what each process does first, `single_threaded` where nothing is said.

    Ctrl-C ends it with what is finished; the next call goes on from there.
    """
    have = finished(path)
    open_cases = [case for case in cases if case.key not in have]
    results = _results(open_cases, work, processes, told, begin or single_threaded)
    told(f"{len(cases)} cases, {len(cases) - len(open_cases)} of them finished before.")
    path.parent.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    with path.open("a", encoding="utf-8") as file:
        _begin_line(path, file)
        for number, record in enumerate(results, start=1):
            have[record["key"]] = record
            file.write(json.dumps(record) + "\n")
            file.flush()
            left = _left(begun, number, len(open_cases))
            told(f"{number}/{len(open_cases)} {record['key']}{left}")
    return {case.key: have[case.key] for case in cases if case.key in have}


def _begin_line(path: Path, file: Any) -> None:
    """After a line that was cut off the next begins anew."""
    text = path.read_bytes()
    if text and not text.endswith(b"\n"):
        file.write("\n")


def _results(
    cases: Sequence[Any],
    work: Work,
    processes: int,
    told: Callable[[str], None],
    begin: Callable[[], None],
) -> Iterator[Record]:
    waiting = iter(cases)
    with _pool(processes, begin) as pool:
        running: dict[Future[Record], str] = {}
        try:
            for case in waiting:
                running[pool.submit(work, case)] = case.key
                if len(running) >= processes * AHEAD:
                    break
            while running:
                ready, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in ready:
                    key = running.pop(future)
                    for case in waiting:
                        running[pool.submit(work, case)] = case.key
                        break
                    yield _answer(future, key)
        except KeyboardInterrupt:
            for future in running:
                future.cancel()
            told("Stopped; the same command goes on from here.")


def _answer(future: Future[Record], key: str) -> Record:
    """What a case gave; a case that failed is a result too, and counts as one."""
    error = future.exception()
    if error is None:
        return future.result()
    return {"key": key, "failed": f"{type(error).__name__}: {error}"}


def _left(begun: float, done: int, total: int) -> str:
    minutes = (time.monotonic() - begun) / done * (total - done) / 60.0
    return f", about {minutes:.0f} min left" if minutes >= 1.0 else ""


@contextmanager
def _pool(processes: int, begin: Callable[[], None]) -> Iterator[ProcessPoolExecutor]:
    context = multiprocessing.get_context("spawn")
    with one_thread_each(), ProcessPoolExecutor(processes, context, initializer=begin) as pool:
        yield pool


@contextmanager
def one_thread_each() -> Iterator[None]:
    """The environment in which processes start whose mathematics must not fight for the cores:
    their libraries read it once, when imported."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ |= dict.fromkeys(THREADS, "1")
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def single_threaded() -> None:
    """What each process does first."""
    import core.identify.predictor as predictor

    predictor.WORKERS = 1
