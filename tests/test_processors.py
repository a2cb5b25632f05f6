"""All threads and worker processes take their number from what this process may run on, or from
what a computation was allowed."""

from __future__ import annotations

import os
import sys
import threading

import pytest
from threadpoolctl import threadpool_info

from flexgui.core import processors
from flexgui.core.errors import InputError
from flexgui.core.progress import Silent, current_progress, use_progress
from flexgui.jobs import executor


@pytest.mark.parametrize("there", [1, 2, 16])
def test_the_processors_of_this_process_are_counted(
    there: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "process_cpu_count", lambda: there, raising=False)
    assert processors.usable() == there
    monkeypatch.delattr(os, "process_cpu_count")
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(there)), raising=False)
    assert processors.usable() == there


def test_one_setting_serves_all() -> None:
    assert processors.workers() == processors.WORKERS == processors.usable()
    assert executor.Processes().count == processors.usable()


@pytest.fixture
def sixteen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processors, "WORKERS", 16)


@pytest.mark.usefixtures("sixteen")
@pytest.mark.parametrize("allowed", [1, 2, 5, 15])
@pytest.mark.parametrize("tasks", [1, 2, 7, 40])
def test_threads_that_start_threads_are_no_more_than_allowed(allowed: int, tasks: int) -> None:
    with processors.at_most(allowed), processors.thread_pool(tasks) as pool:
        inside = list(pool.map(lambda _: processors.workers(), range(tasks)))
        assert min(tasks, allowed) * max(inside) <= allowed
    assert processors.workers() == 16 and not processors.is_limited()


@pytest.mark.usefixtures("sixteen")
def test_an_inner_limit_never_allows_more_than_an_outer_one() -> None:
    with processors.at_most(3), processors.at_most(8):
        assert processors.workers() == 3
    with processors.at_most(3), processors.at_most(None), processors.at_most(2):
        assert processors.workers() == 2
    with processors.at_most(99):
        assert processors.workers() == 16 and not processors.is_limited(), "as many as there are"


def test_a_limit_holds_for_its_own_thread_alone() -> None:
    seen: list[bool] = []
    with processors.at_most(1) if processors.WORKERS > 1 else processors.at_most(None):
        other = threading.Thread(target=lambda: seen.append(processors.is_limited()))
        other.start()
        other.join()
    assert seen == [False]


def test_limited_work_beside_is_done_here_and_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processors, "WORKERS", 16)
    with processors.at_most(2), processors.threads_beside(2) as beside:
        assert beside.submit(threading.get_ident).result() == threading.get_ident()


def test_threads_of_a_pool_ask_the_progress_of_who_made_it() -> None:
    asked = Silent()
    with use_progress(asked), processors.thread_pool(2) as pool:
        assert list(pool.map(lambda _: current_progress(), range(4))) == [asked] * 4
    assert current_progress() is None


@pytest.mark.parametrize("count", [0, -1, 1.5, True, "2"])
def test_a_number_that_cannot_be_is_one_sentence(count: object) -> None:
    with pytest.raises(InputError, match=r"workers is .*; it must be a whole number of at least 1"):
        processors.at_most(count).__enter__()  # type: ignore[arg-type]


def algebra_threads() -> list[int]:
    """Threads of each library of linear algebra that is loaded."""
    return [x["num_threads"] for x in threadpool_info() if x["user_api"] == "blas"]


def test_searches_at_once_leave_the_interpreter_as_they_found_it() -> None:
    before, threads = sys.getswitchinterval(), algebra_threads()
    first, second = processors.fast_thread_switching(), processors.fast_thread_switching()
    first.__enter__()
    second.__enter__()
    assert sys.getswitchinterval() == pytest.approx(processors.SWITCH_INTERVAL)
    first.__exit__(None, None, None)  # the second still runs
    assert sys.getswitchinterval() == pytest.approx(processors.SWITCH_INTERVAL)
    assert set(algebra_threads()) == {1}
    second.__exit__(None, None, None)
    assert sys.getswitchinterval() == pytest.approx(before)
    assert algebra_threads() == threads
