"""How many processors there are to use, by all threads and worker processes, and how threads share
one."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager


def usable() -> int:
    """Those that this process may run on, where the system states them; at least one."""
    counted = getattr(os, "process_cpu_count", None)  # from Python 3.13 on
    if counted is not None:
        return counted() or 1
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


WORKERS = usable()
"""Compiled simulation holds no lock, so that threads use them all."""

SWITCH_INTERVAL = 1e-4
"""s after which a waiting thread gets the interpreter. Short compiled calls wait for it when they
end: with Python's 5 ms two threads were no faster than one (EMPS 18.6 s, with this 14.4 s); shorter
brings no more."""


_SWITCH_LOCK = threading.Lock()
_previous_intervals: list[float] = []
"""The interval before each of those who shortened it."""


@contextmanager
def fast_thread_switching() -> Iterator[None]:
    """Shortens the interval while threads alternate between short compiled calls; the last of
    several restores it."""
    with _SWITCH_LOCK:
        _previous_intervals.append(
            sys.getswitchinterval() if not _previous_intervals else _previous_intervals[0]
        )
        sys.setswitchinterval(min(_previous_intervals[0], SWITCH_INTERVAL))
    try:
        yield
    finally:
        with _SWITCH_LOCK:
            before = _previous_intervals.pop()
            if not _previous_intervals:
                sys.setswitchinterval(before)
