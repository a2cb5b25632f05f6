"""What was used last is kept as long as there is room for it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flexgui.core.bounded_cache import BoundedCache


def squares(kept: BoundedCache[np.ndarray]) -> tuple[list[int], Callable[[int], np.ndarray]]:
    """The numbers for which squares were made, and what asks for them."""
    made: list[int] = []

    def asked(n: int) -> np.ndarray:
        def make() -> np.ndarray:
            made.append(n)
            return np.arange(n, dtype=float) ** 2

        return kept.get(n, make)

    return made, asked


def by_bytes(capacity: int) -> BoundedCache[np.ndarray]:
    return BoundedCache(8 * capacity, lambda x: x.nbytes)


def test_a_value_is_made_once_while_there_is_room() -> None:
    made, asked = squares(by_bytes(30))
    for _ in range(3):
        for n in (9, 10, 11):
            assert len(asked(n)) == n
    assert made == [9, 10, 11]


@pytest.mark.parametrize("kept", [by_bytes(20), BoundedCache(2)])
def test_what_was_used_longest_ago_goes_first(kept: BoundedCache[np.ndarray]) -> None:
    made, asked = squares(kept)
    for n in (9, 10, 9, 11, 9, 10):
        asked(n)
    assert made == [9, 10, 11, 10]


def test_one_that_is_larger_than_the_room_stays_until_the_next() -> None:
    made, asked = squares(by_bytes(1))
    for n in (100, 100, 50, 100):
        asked(n)
    assert made == [100, 50, 100]
