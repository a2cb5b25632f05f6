"""Results are kept as long as there is room for them."""

from __future__ import annotations

import numpy as np

from core.identify.recent import recently


def counted(room: int) -> tuple[list[int], object]:
    made: list[int] = []

    @recently(bytes_of=lambda x: x.nbytes, room=room)
    def squares(n: int) -> np.ndarray:
        made.append(n)
        return np.arange(n, dtype=float) ** 2

    return made, squares


def test_a_result_is_made_once_while_there_is_room() -> None:
    made, squares = counted(room=8 * 30)
    for _ in range(3):
        for n in (9, 10, 11):
            assert len(squares(n)) == n  # type: ignore[operator]
    assert made == [9, 10, 11]


def test_what_was_used_longest_ago_goes_first() -> None:
    made, squares = counted(room=8 * 20)
    for n in (9, 10, 9, 11, 9, 10):
        squares(n)  # type: ignore[operator]
    assert made == [9, 10, 11, 10]


def test_one_that_is_larger_than_the_room_is_kept_until_the_next() -> None:
    made, squares = counted(room=8)
    for n in (100, 100, 50, 100):
        squares(n)  # type: ignore[operator]
    assert made == [100, 50, 100]
