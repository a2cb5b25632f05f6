"""All threads and worker processes take their number from what this process may run on."""

from __future__ import annotations

import os

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
