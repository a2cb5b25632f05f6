from __future__ import annotations

import pytest

from flexgui.views.ladder import _ticks


def test_the_axis_names_numbers_that_are_read_at_a_glance() -> None:
    assert _ticks(16.0)["ticktext"] == ["1", "2", "5", "10", "20", "50"]


def test_a_high_ladder_names_decades_only() -> None:
    assert _ticks(4000.0)["ticktext"] == ["1", "10", "100", "1000"]


@pytest.mark.parametrize("end", [0.5, 1.0, 9.99, 10.0, 299.0, 1e5])
def test_the_floor_is_always_named(end: float) -> None:
    assert _ticks(end)["tickvals"][0] == 1
