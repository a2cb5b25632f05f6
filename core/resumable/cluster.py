"""Orders on the workers of a Dask cluster (extra `cluster`)."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from queue import Empty, Queue
from typing import Any

from core.errors import InputError
from core.resumable.executor import CALM, Answers, Executor, Stop, Work, never

PATIENCE = 10
"""s to reach the scheduler."""


class Cluster(Executor):
    """The scheduler's address is like tcp://host:8786; its workers need FlexGUI installed.

    Only text travels, so the workers need not share a file system with this machine. The
    scheduler gives the orders of a lost worker to others.
    """

    def __init__(self, address: str) -> None:
        self.address = address

    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        distributed = _distributed()
        with self._client(distributed) as client:
            done: Queue[Any] = Queue()
            futures = {
                client.submit(work, order, pure=False): index for index, order in enumerate(orders)
            }
            for future in futures:
                future.add_done_callback(done.put)
            try:
                while futures:
                    future = _next(done)
                    if future is not None:
                        yield futures.pop(future), _result(future)
                    if stop():
                        return
            finally:
                client.cancel(list(futures))

    def _client(self, distributed: Any) -> Any:
        try:
            return distributed.Client(self.address, timeout=PATIENCE, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(
                f"No Dask scheduler answers at {self.address}; check --cluster and that "
                f"`dask scheduler` runs there."
            ) from error


def _distributed() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            "--cluster needs Dask; install it with pip install 'flexgui[cluster]'."
        ) from error
    return distributed


def _next(done: Queue[Any]) -> Any:
    """A future that is done; None where none was in a little while."""
    with suppress(Empty):
        return done.get(timeout=CALM)
    return None


def _result(future: Any) -> str:
    error = future.exception()
    if error is None:
        return str(future.result())
    if isinstance(error, InputError):
        raise error
    kind = type(error).__name__
    raise InputError(f"The cluster gave up on a piece of work ({kind}: {error}).") from error
