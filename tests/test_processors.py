"""All threads and worker processes take their number from what this process may run on."""

from __future__ import annotations

import os
import sys

import pytest

from flexgui.core import loading, processors
from flexgui.core.identify import predictor
from flexgui.core.resumable import executor


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
    assert predictor.workers() == loading.WORKERS == processors.WORKERS == processors.usable()
    assert executor.Processes().count == processors.usable()


def test_searches_at_once_leave_the_interpreter_as_they_found_it() -> None:
    before = sys.getswitchinterval()
    first, second = processors.fast_thread_switching(), processors.fast_thread_switching()
    first.__enter__()
    second.__enter__()
    assert sys.getswitchinterval() == pytest.approx(processors.SWITCH_INTERVAL)
    first.__exit__(None, None, None)  # the second still runs
    assert sys.getswitchinterval() == pytest.approx(processors.SWITCH_INTERVAL)
    second.__exit__(None, None, None)
    assert sys.getswitchinterval() == pytest.approx(before)
