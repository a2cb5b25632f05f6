"""Results that are kept for a while, by the room that they take."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import wraps
from typing import TypeVar

Key = TypeVar("Key", bound=Hashable)
Found = TypeVar("Found")

ROOM = 64 * 2**20
"""Bytes: some dozen recordings of ten thousand samples, each at a few values of a parameter, or one
of hundreds of thousands of samples. A number of results would be too few for many short recordings,
which then push each other out, and too many for long ones."""


def recently(
    *, bytes_of: Callable[[Found], int], room: int = ROOM
) -> Callable[[Callable[[Key], Found]], Callable[[Key], Found]]:
    """A decorator: the function of one hashable argument keeps its last results.

    Args:
        bytes_of: what a result takes.
        room: bytes that all of them may take; the last one always stays.

    Returns:
        The decorator. Threads may call the function at once; nobody may change a result.
    """

    def decorated(function: Callable[[Key], Found]) -> Callable[[Key], Found]:
        kept: OrderedDict[Key, Found] = OrderedDict()
        lock, taken = threading.Lock(), 0

        @wraps(function)
        def found(key: Key) -> Found:
            nonlocal taken
            with lock:
                if key in kept:
                    kept.move_to_end(key)
                    return kept[key]
            made = function(key)
            with lock:
                if key not in kept:
                    kept[key] = made
                    taken += bytes_of(made)
                while taken > room and len(kept) > 1:
                    taken -= bytes_of(kept.popitem(last=False)[1])
            return made

        return found

    return decorated
