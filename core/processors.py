"""How many processors there are to use, by all threads and worker processes, and how threads share
one."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from contextvars import Context, ContextVar, copy_context
from functools import partial
from typing import Any

from threadpoolctl import threadpool_limits

from .errors import InputError


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

_MOST: ContextVar[int | None] = ContextVar("_MOST", default=None)
"""Processors that the present computation may use; None: all, and work may run beside it."""


def workers() -> int:
    """Processors that the present computation may use, in threads or processes."""
    return _MOST.get() or WORKERS


def is_limited() -> bool:
    """Whether somebody has stated fewer processors than there are: then nothing runs beside."""
    return _MOST.get() is not None


@contextmanager
def at_most(count: int | None) -> Iterator[None]:
    """Inside it a computation uses so many processors at most; None: as before. InputError for a
    number that cannot be."""
    most = _MOST.get() if count is None or _checked(count) >= workers() else count
    token = _MOST.set(most)
    try:
        yield
    finally:
        _MOST.reset(token)


def _checked(count: int) -> int:
    if not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise InputError(f"workers is {count!r}; it must be a whole number of at least 1.")
    return count


@contextmanager
def thread_pool(tasks: int) -> Iterator[ThreadPoolExecutor]:
    """Threads for so many tasks, in the context of this one. Where processors are limited they
    share them, with what they start themselves."""
    threads = max(min(workers(), tasks), 1)
    share = max(workers() // threads, 1) if is_limited() else None
    enter = partial(_enter, copy_context(), share)
    with ThreadPoolExecutor(threads, initializer=enter) as pool:
        yield pool


def _enter(context: Context, share: int | None) -> None:
    for variable, value in context.items():
        variable.set(value)
    _MOST.set(share)


@contextmanager
def threads_beside(count: int) -> Iterator[Executor]:
    """Threads for work beside a computation; with limited processors it is done when submitted."""
    with _Here() if is_limited() else ThreadPoolExecutor(count) as pool:
        yield pool


class _Here(Executor):
    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        done: Future[Any] = Future()
        done.set_result(fn(*args, **kwargs))
        return done


THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

_starting = threading.Lock()
"""The environment is one for all threads that start processes."""


@contextmanager
def one_thread_each() -> Iterator[None]:
    """The environment in which processes start whose mathematics must not fight for the cores:
    their libraries read it once, when imported. One thread at a time; do no more than start."""
    with _starting:
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


SWITCH_INTERVAL = 1e-4
"""s after which a waiting thread gets the interpreter. Short compiled calls wait for it when they
end: with Python's 5 ms two threads were no faster than one (EMPS 18.6 s, with this 14.4 s); shorter
brings no more."""


_SWITCH_LOCK = threading.Lock()
_computing: list[ExitStack] = []
"""What restores the settings below, once for each computation that goes on."""


@contextmanager
def fast_thread_switching() -> Iterator[None]:
    """Shortens the interval while threads alternate between short compiled calls, and keeps linear
    algebra in the thread that asks for it: its own threads wait busily, and small matrices took
    fourteen times the processor time. The last of several computations restores both."""
    with _SWITCH_LOCK:
        settings = _computing[0] if _computing else _fast_settings()
        _computing.append(settings)
    try:
        yield
    finally:
        with _SWITCH_LOCK:
            _computing.pop()
            if not _computing:
                settings.close()


def _fast_settings() -> ExitStack:
    """Makes the settings; what restores them."""
    settings, before = ExitStack(), sys.getswitchinterval()
    settings.callback(sys.setswitchinterval, before)
    sys.setswitchinterval(min(before, SWITCH_INTERVAL))
    settings.enter_context(threadpool_limits(1, user_api="blas"))
    return settings
