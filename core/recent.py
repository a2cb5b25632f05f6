"""What was used last, kept while there is room for it."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

V = TypeVar("V")


def _one(_: object) -> int:
    return 1


class Recent(Generic[V]):
    """What was used last, by key; the oldest goes first. Thread-safe; nobody may change a value.

    Args:
        capacity: what all values may take together; the last one stays whatever it takes.
        size_of: what a value takes; without it `capacity` is a number of values.
    """

    def __init__(self, capacity: int, size_of: Callable[[V], int] = _one) -> None:
        self._capacity, self._size_of, self._taken = capacity, size_of, 0
        self._lock = threading.Lock()
        self._known: OrderedDict[Hashable, V] = OrderedDict()

    def __contains__(self, key: Hashable) -> bool:
        with self._lock:
            return key in self._known

    def get(self, key: Hashable, make: Callable[[], V]) -> V:
        """What is known, else what `make` gives; of two who make it at once both get one."""
        with self._lock:
            if key in self._known:
                self._known.move_to_end(key)
                return self._known[key]
        return self.put(key, make())

    def put(self, key: Hashable, value: V) -> V:
        """Keeps a value; of two for the same key the first, which it gives."""
        with self._lock:
            if key not in self._known:
                self._known[key] = value
                self._taken += self._size_of(value)
            value = self._known[key]
            while self._taken > self._capacity and len(self._known) > 1:
                self._taken -= self._size_of(self._known.popitem(last=False)[1])
        return value
