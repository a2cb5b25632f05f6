"""How orders become answers: the contract of an executor, and the plainest one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Generator, Sequence

from core.errors import InputError

Work = Callable[[str], str]
"""Order in, answer out: one line of JSON with `key`. Other processes find it by the names of its
module and its own; nothing but text travels to them."""

Answers = Generator[tuple[int, str], None, None]
"""(index of the order, answer)"""

Stop = Callable[[], bool]

MOST_LOSSES = 3
"""An order that so many workers died over is not given to another."""

CALM = 0.2
"""s between two looks whether somebody wants to stop."""


def never() -> bool:
    """Nobody wants to stop."""
    return False


def give_again(index: int, waiting: deque[int], losses: Counter[int]) -> None:
    """The order of a worker that died goes to the front; InputError where too many did over it."""
    losses[index] += 1
    if losses[index] >= MOST_LOSSES:
        raise InputError(
            f"{MOST_LOSSES} workers ended one after the other over the same piece of work; check "
            f"the memory that is free and start again: what is finished is kept."
        )
    waiting.appendleft(index)


class Executor(ABC):
    """Does the work somewhere; answers come as they are ready.

    An answer is a function of its order, so an order may be given again where a worker was lost.
    """

    @abstractmethod
    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        """In any order; ends early where `stop` says so.

        Closing the generator leaves no work behind.
        """


class Here(Executor):
    """One after the other, in this process."""

    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        for index, order in enumerate(orders):
            if stop():
                return
            yield index, work(order)
