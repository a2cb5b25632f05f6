"""How orders become answers: the contract of an executor, in this process, on spawned ones and on
the workers of a Dask cluster (extra `cluster`)."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import traceback
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from queue import Empty, Queue
from typing import Any

from ..errors import InputError
from ..processors import WORKERS
from ..sentences import install_command

Work = Callable[[str], str]
"""Order in, answer out: one line of JSON with `key`. Other processes find it by the names of its
module and its own; nothing but text travels to them."""

Answers = Generator[tuple[int, str], None, None]
"""(index of the order, answer)"""

Stop = Callable[[], bool]

MOST_LOSSES = 3
"""An order that so many workers died over is not given to another."""

POLL_INTERVAL = 0.2
"""s between two looks whether somebody wants to stop."""


def never() -> bool:
    """Nobody wants to stop."""
    return False


def requeue(index: int, waiting: deque[int], losses: Counter[int]) -> None:
    """The order of a worker that died goes to the front; InputError where too many did over it."""
    losses[index] += 1
    if losses[index] >= MOST_LOSSES:
        raise InputError(
            f"{MOST_LOSSES} workers stopped on the same task; check the free memory and start "
            f"again. Finished tasks are kept."
        )
    waiting.appendleft(index)


class Executor(ABC):
    """Computes answers, in the order in which they are ready; an order may be repeated on another
    worker if its own was lost. An error of the program ends all work at once: RuntimeError."""

    @abstractmethod
    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        """In any order; ends early where `stop` is true. Closing the generator stops all work."""


class Here(Executor):
    """One after the other, in this process."""

    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        for index, order in enumerate(orders):
            if stop():
                return
            yield index, work(order)


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


REFUSED, FAILED = "\0", "\1"
"""Begin a message that is no answer: a sentence about the input, or an error of the program and,
after another FAILED, its traceback."""

FAREWELL = 2.0
"""s that a worker has to end before it is made to."""


@dataclass
class _Worker:
    process: BaseProcess
    connection: Connection
    order: int | None = None
    """What it works on; None where it waits."""


class Processes(Executor):
    """As many at a time as there are workers, each with one thread of linear algebra."""

    def __init__(self, workers: int = WORKERS, option: str = "--workers") -> None:
        """`option` is how whoever chose the number of workers knows it."""
        if workers < 1:
            raise InputError(f"{option} is {workers}; it must be at least 1.")
        self.count = workers
        self._workers: list[_Worker] = []

    def pids(self) -> list[int]:
        """Of the workers that there are now."""
        return [w.process.pid for w in self._workers if w.process.pid is not None]

    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        waiting, losses = deque(range(len(orders))), Counter[int]()
        try:
            while waiting or self._busy():
                while len(self._workers) < min(self.count, len(waiting) + len(self._busy())):
                    self._workers.append(_hire(work))
                for worker in self._workers:
                    if waiting and worker.order is None:
                        _give(worker, waiting.popleft(), orders)
                wait([w.connection for w in self._workers], POLL_INTERVAL)
                yield from self._collect(waiting, losses)
                if stop():
                    return
        finally:
            self._dismiss()

    def _busy(self) -> list[_Worker]:
        return [w for w in self._workers if w.order is not None]

    def _collect(self, waiting: deque[int], losses: Counter[int]) -> Iterator[tuple[int, str]]:
        """Answers that have come; the order of a worker that died goes back to the front."""
        for worker in list(self._workers):
            if worker.order is None:
                if not worker.process.is_alive():
                    self._workers.remove(worker)
                continue
            index = worker.order
            try:
                if not worker.connection.poll():
                    continue
                text = worker.connection.recv_bytes().decode()
            except (EOFError, OSError):
                self._replace_worker(worker, index, waiting, losses)
                continue
            worker.order = None
            yield index, _received(text)

    def _replace_worker(
        self, worker: _Worker, index: int, waiting: deque[int], losses: Counter[int]
    ) -> None:
        self._workers.remove(worker)
        worker.connection.close()
        worker.process.join(FAREWELL)
        requeue(index, waiting, losses)

    def _dismiss(self) -> None:
        for worker in self._workers:
            worker.connection.close()
            worker.process.terminate()
        for worker in self._workers:
            worker.process.join(FAREWELL)
            if worker.process.is_alive():
                worker.process.kill()
        self._workers.clear()


def _give(worker: _Worker, index: int, orders: Sequence[str]) -> None:
    worker.order = index
    with suppress(OSError):  # one that died meanwhile is noticed when its answer is awaited
        worker.connection.send_bytes(orders[index].encode())


def _hire(work: Work) -> _Worker:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, work), daemon=True, name="cases")
    with one_thread_each():
        process.start()
    theirs.close()
    return _Worker(process, ours)


def _serve(connection: Connection, work: Work) -> None:
    """A worker: orders in, answers out, until nobody is there any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    while True:
        try:
            order = connection.recv_bytes().decode()
        except (EOFError, OSError):
            return
        try:
            answer = _answer(work, order)
        except MemoryError:  # as one that the system ended: another may find more memory
            return
        connection.send_bytes(answer.encode())


def _answer(work: Work, order: str) -> str:
    """The answer or what went wrong, for `_received`."""
    try:
        return work(order)
    except InputError as error:
        return f"{REFUSED}{error}"
    except MemoryError:
        raise
    except Exception as error:
        return f"{FAILED}{type(error).__name__}: {error}{FAILED}{traceback.format_exc()}"


def _received(text: str) -> str:
    """The answer that a worker sent; InputError or RuntimeError for what went wrong there."""
    if text.startswith(REFUSED):
        raise InputError(text.removeprefix(REFUSED))
    if text.startswith(FAILED):
        reason, _, trace = text.removeprefix(FAILED).partition(FAILED)
        error = RuntimeError(f"{reason}, in a worker process")
        error.add_note(trace)
        raise error
    return text


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
                client.submit(_answer, work, order, pure=False): index
                for index, order in enumerate(orders)
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
        except (OSError, TimeoutError, ValueError):
            raise InputError(
                f"No Dask scheduler answers at {self.address}; check --cluster and that "
                f"`dask scheduler` runs there."
            ) from None


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError(f"--cluster needs Dask; run {install_command('cluster')}.") from None
    return distributed


def _next(done: Queue[Any]) -> Any:
    """A future that is done; None where none was in a little while."""
    with suppress(Empty):
        return done.get(timeout=POLL_INTERVAL)
    return None


def _result(future: Any) -> str:
    """The answer; InputError where the cluster could not run the task."""
    error = future.exception()
    if error is None:
        return _received(future.result())
    kind = type(error).__name__
    raise InputError(f"The cluster gave up a task ({kind}: {error}).") from None
