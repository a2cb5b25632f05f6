"""How many processors there are to use: the one setting of all threads and worker processes."""

from __future__ import annotations

import os


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
