"""Whoever runs a study, and in whatever order and how often interrupted: the same numbers."""

from __future__ import annotations

import json
import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import pytest

from flexgui.core.errors import InputError
from flexgui.core.montecarlo.study import study, study_cases
from flexgui.core.processors import THREADS, one_thread_each
from flexgui.core.resumable.executor import Answers, Cluster, Executor, Here, Stop, Work, never
from flexgui.jobs.executor import MOST_LOSSES, Processes
from tests.montecarlo.failing import fill_memory, lose_key
from tests.montecarlo.helpers import FITS, numbers, records_of, short

NO_DASK = pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed")


class Backwards(Executor):
    """The last order first."""

    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        for index, text in Here().answers(work, orders[::-1], stop):
            yield len(orders) - 1 - index, text


@pytest.fixture(scope="module")
def expected() -> dict[str, object]:
    return numbers(records_of(study(short(), executor=Here(), only=FITS)))


def test_neither_their_order_nor_more_runs_change_a_case(expected: dict[str, object]) -> None:
    settings = short(runs=3)
    steps = list(study(settings, executor=Backwards(), only=FITS))
    keys = [step.record["key"] for step in steps]
    assert sorted(keys) == sorted(c.key for c in study_cases(settings, FITS))
    assert [step.done for step in steps] == list(range(1, steps[-1].total + 1))
    more = numbers(records_of(steps))
    assert {key: more[key] for key in expected} == expected
    assert len(more) == len(expected) + 2


@pytest.mark.long
def test_a_killed_worker_is_replaced_and_the_numbers_are_the_same(
    expected: dict[str, object],
) -> None:
    executor = Processes(2)
    found, killed = {}, []
    for step in study(short(), executor=executor, only=FITS):
        found[step.record["key"]] = step.record
        if not killed:
            killed.append(executor.pids()[0])
            os.kill(killed[0], signal.SIGKILL)
    assert numbers({key: found[key] for key in expected}) == expected
    assert not executor.pids()


def test_a_stopped_study_goes_on_and_repeats_nothing(
    tmp_path: Path, expected: dict[str, object]
) -> None:
    path = tmp_path / "results.jsonl"
    seen: list[str] = []
    for step in study(short(), executor=Here(), path=path, only=FITS, stop=lambda: len(seen) > 1):
        seen.append(step.record["key"])
    assert 0 < len(seen) < len(expected)
    with path.open("a", encoding="utf-8") as file:
        file.write('{"key": "fits/inf/0002", "part": "fi')  # torn by a power cut
    later = list(study(short(), executor=Here(), path=path, only=FITS))
    assert [s.record["key"] for s in later if s.before] == seen
    assert numbers({s.record["key"]: s.record for s in later}) == expected
    lines = path.read_text(encoding="utf-8").splitlines()
    keys = [json.loads(line).get("key") for line in lines if line.endswith("}")]
    assert len(keys) == len(set(keys))


def test_results_of_another_study_are_not_mixed_in(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    next(iter(study(short(), executor=Here(), path=path, only=FITS)))
    with pytest.raises(InputError, match="another study"):
        list(study(short(seed=2), executor=Here(), path=path, only=FITS))


@contextmanager
def processes() -> Iterator[Executor]:
    yield Processes(1)


@contextmanager
def cluster(**settings: object) -> Iterator[Executor]:
    from distributed import LocalCluster

    with LocalCluster(dashboard_address=None, **settings) as made:
        yield Cluster(made.scheduler_address)


@pytest.mark.parametrize(
    "workers",
    [
        processes,
        pytest.param(
            partial(cluster, n_workers=1, processes=False), marks=[NO_DASK, pytest.mark.long]
        ),
    ],
    ids=["processes", "cluster"],
)
def test_an_error_of_the_program_ends_the_work_at_once_and_keeps_its_traceback(
    workers: Callable[[], AbstractContextManager[Executor]], tmp_path: Path
) -> None:
    runs = tmp_path / "runs"
    with workers() as executor, pytest.raises(RuntimeError, match="KeyError: 'mass'") as raised:
        list(executor.answers(lose_key, [str(runs)]))
    assert runs.read_text() == "run\n"
    assert "in lose_key" in "".join(traceback.format_exception(raised.value))


def test_work_without_enough_memory_is_tried_by_others_and_says_so(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    with pytest.raises(InputError, match="free memory"):
        list(Processes(1).answers(fill_memory, [str(runs)]))
    assert runs.read_text() == "run\n" * MOST_LOSSES


def test_processes_that_start_at_once_have_one_thread_and_leave_the_environment_as_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(THREADS[0], "4")
    monkeypatch.delenv(THREADS[1], raising=False)
    before, inside, left = dict(os.environ), threading.Event(), threading.Event()

    def start() -> set[str]:
        with one_thread_each():
            inside.set()
            left.wait()
            return {os.environ[name] for name in THREADS}

    with ThreadPoolExecutor(1) as threads:
        with one_thread_each():
            other = threads.submit(start)
            inside.wait(0.1)  # it may be inside, or it may have to wait
        left.set()
        assert other.result() == {"1"}
    assert dict(os.environ) == before


@NO_DASK
@pytest.mark.long
def test_a_dask_cluster_gives_the_same_numbers(expected: dict[str, object]) -> None:
    with cluster(n_workers=2, threads_per_worker=1) as executor:
        found = records_of(study(short(), executor=executor, only=FITS))
    assert numbers(found) == expected


@NO_DASK
def test_a_scheduler_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from flexgui.core.resumable import executor

    monkeypatch.setattr(executor, "PATIENCE", 1)
    with pytest.raises(InputError, match="tcp://127.0.0.1:9"):
        list(study(short(), executor=executor.Cluster("tcp://127.0.0.1:9"), only=FITS))
