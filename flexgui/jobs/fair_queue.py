"""Who is next: sessions take turns, whoever submits more does not get more."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from typing import Generic, Protocol, TypeVar


class Owned(Protocol):
    """Something that a session waits for."""

    @property
    def session(self) -> str:
        """The key of the session that it belongs to."""


T = TypeVar("T", bound=Owned)


class FairQueue(Generic[T]):
    """Within a session first come, first served. Between sessions the one with the least work
    under way goes first; equals go round, and whoever joins or was served stands at the end.
    Not thread-safe."""

    def __init__(self) -> None:
        self._round: dict[str, deque[T]] = {}
        """What waits; a dict keeps the order of the round."""
        self._busy: Counter[str] = Counter()

    def __len__(self) -> int:
        return sum(len(items) for items in self._round.values())

    def waiting_of(self, session: str) -> int:
        """How many items of a session wait."""
        return len(self._round.get(session, ()))

    def put(self, item: T) -> None:
        """Add an item behind those of its session."""
        self._round.setdefault(item.session, deque()).append(item)

    def remove(self, item: T) -> None:
        """Forget an item that waits."""
        items = self._round[item.session]
        items.remove(item)
        if not items:
            del self._round[item.session]

    def take(self) -> T | None:
        """The next item, which is then under way; None where nothing waits."""
        return _serve(self._round, self._busy) if self._round else None

    def done(self, item: T) -> None:
        """An item that was taken is no longer under way."""
        self._busy[item.session] -= 1
        self._busy = +self._busy  # only sessions that are busy

    def order(self) -> Iterator[T]:
        """All that wait, in the order in which they would go if nothing ended meanwhile."""
        again = {session: items.copy() for session, items in self._round.items()}
        busy = self._busy.copy()
        while again:
            yield _serve(again, busy)


def _serve(waiting: dict[str, deque[T]], busy: Counter[str]) -> T:
    """Takes the next item; its session goes to the end of the round."""
    session = min(waiting, key=busy.__getitem__)  # the first of equals
    items = waiting.pop(session)
    item = items.popleft()
    if items:
        waiting[session] = items
    busy[session] += 1
    return item
