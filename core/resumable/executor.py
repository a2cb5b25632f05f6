"""How orders become answers: the contract of an executor, in this process and on the workers of a
Dask cluster (extra `cluster`); `flexgui.jobs.executor` has spawned processes."""

from __future__ import annotations

import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from queue import Empty, Queue
from typing import Any

from ..errors import InputError
from ..sentences import install_command

Work = Callable[[str], str]
"""Order in, answer out: one line of JSON with `key`. Other processes find it by the names of its
module and its own; nothing but text travels to them."""

Answers = Generator[tuple[int, str], None, None]
"""(index of the order, answer)"""

Stop = Callable[[], bool]


class WorkFailedError(RuntimeError):
    """An error of the program in a worker; a note has its traceback."""

    def __init__(self, sentence: str, trace: str) -> None:
        super().__init__(sentence)
        self.add_note(trace)


POLL_INTERVAL = 0.2
"""s between two looks whether somebody wants to stop."""


def never() -> bool:
    """Nobody wants to stop."""
    return False


class Executor(ABC):
    """Computes answers, in the order in which they are ready; an order may be repeated on another
    worker if its own was lost. An error of the program ends all work at once: WorkFailedError."""

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


REFUSED, FAILED = "\0", "\1"
"""Begin a message that is no answer: a sentence about the input, or an error of the program and,
after another FAILED, its traceback."""


def _answer(work: Work, order: str) -> str:
    """The answer or what went wrong, for `_received`; the cluster reports a lack of memory."""
    try:
        return work(order)
    except InputError as error:
        return f"{REFUSED}{error}"
    except MemoryError:
        raise
    except Exception as error:
        return f"{FAILED}{type(error).__name__}: {error}{FAILED}{traceback.format_exc()}"


def _received(text: str) -> str:
    """The answer that a worker sent; InputError or WorkFailedError for what went wrong there."""
    if text.startswith(REFUSED):
        raise InputError(text.removeprefix(REFUSED))
    if text.startswith(FAILED):
        reason, _, trace = text.removeprefix(FAILED).partition(FAILED)
        raise WorkFailedError(f"{reason}, in a worker process", trace)
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
