"""Jobs of compiled code on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache

from core.identify import predictor
from core.progress import heeded, heeding, look


@cache
def _pool() -> ThreadPoolExecutor:
    """Made once: starting threads takes longer than a small cost."""
    return ThreadPoolExecutor(predictor.WORKERS, thread_name_prefix="linear")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # its threads stay with the parent


def share(jobs: Sequence[Callable[[], None]], workers: int | None = None) -> None:
    """Does the jobs on all cores (or `workers` threads); the caller's thread takes its part.

    Compiled code holds no lock. Somebody may stop the work between two jobs. An exception of a
    job is raised here.
    """
    waiting, progress = iter(jobs), heeded()

    def work() -> None:
        with heeding(progress):
            for job in waiting:
                look()
                job()

    others = min(workers or predictor.WORKERS, len(jobs)) - 1
    helpers = [_pool().submit(work) for _ in range(others)]
    work()
    for helper in helpers:
        helper.result()
