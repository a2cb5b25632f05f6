"""How orders become answers: the contract of an executor, and the plainest one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence

from core.montecarlo.work import answer_text

Stop = Callable[[], bool]

CALM = 0.2
"""s between two looks whether somebody wants to stop."""


def never() -> bool:
    """Nobody wants to stop."""
    return False


class Executor(ABC):
    """Runs texts through `answer_text` somewhere; answers come as they are ready.

    An order is a function of its text, so it may be run again where a worker was lost.
    """

    @abstractmethod
    def answers(self, orders: Sequence[str], stop: Stop = never) -> Iterator[tuple[int, str]]:
        """(index of the order, answer), in any order; ends early where `stop` says so.

        Closing the iterator leaves no work behind.
        """


class Here(Executor):
    """One after the other, in this process."""

    def answers(self, orders: Sequence[str], stop: Stop = never) -> Iterator[tuple[int, str]]:
        for index, order in enumerate(orders):
            if stop():
                return
            yield index, answer_text(order)
