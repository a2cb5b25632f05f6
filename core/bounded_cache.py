"""A cache of bounded size."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

import numpy as np

V = TypeVar("V")


def digest(*arrays: np.ndarray) -> bytes:
    """A key that stands for the numbers of these arrays, so that a cache need not keep them."""
    hasher = hashlib.blake2b(digest_size=16)
    for array in arrays:
        hasher.update(np.ascontiguousarray(array).tobytes())
    return hasher.digest()


class BoundedCache(Generic[V]):
    """The values used last, by key; the oldest is removed first. Thread-safe; values are read-only.
    `capacity`: largest total size of all values, by `size_of`, else their number; the newest always
    stays."""

    def __init__(self, capacity: int, size_of: Callable[[V], int] = lambda _: 1) -> None:
        self._capacity, self._size_of, self._size = capacity, size_of, 0
        self._lock = threading.Lock()
        self._values: OrderedDict[Hashable, V] = OrderedDict()

    def __contains__(self, key: Hashable) -> bool:
        with self._lock:
            return key in self._values

    def get(self, key: Hashable, make: Callable[[], V]) -> V:
        """The value of the key, else the result of `make`; two threads that make it get the
        same."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                return self._values[key]
        return self.put(key, make())

    def put(self, key: Hashable, value: V) -> V:
        """Stores a value and returns it; an existing value of the key stays and is returned."""
        with self._lock:
            if key not in self._values:
                self._values[key] = value
                self._size += self._size_of(value)
            value = self._values[key]
            while self._size > self._capacity and len(self._values) > 1:
                self._size -= self._size_of(self._values.popitem(last=False)[1])
        return value
