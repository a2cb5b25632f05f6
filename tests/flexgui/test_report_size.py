"""Many recordings make the report's signals coarser, not the report heavier."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from hypothesis import given
from hypothesis import strategies as st

from flexgui.export.report import FEWEST, PER_CHANNEL, SIGNALS, points_per_line
from flexgui.views.layout import POINTS


def recordings(counts: list[int]) -> Any:
    return cast(Any, tuple(SimpleNamespace(channels=[None] * n) for n in counts))


@given(st.lists(st.integers(0, 12), max_size=200))
def test_all_signals_together_keep_the_budget_or_are_as_coarse_as_can_be(counts: list[int]) -> None:
    points = points_per_line(recordings(counts))
    assert FEWEST <= points <= POINTS
    assert points == FEWEST or PER_CHANNEL * sum(counts) * points <= SIGNALS


def test_few_recordings_are_drawn_as_finely_as_ever() -> None:
    assert points_per_line(recordings([4, 4])) == POINTS


def test_more_recordings_are_never_drawn_finer() -> None:
    found = [points_per_line(recordings([6] * n)) for n in range(1, 40)]
    assert found == sorted(found, reverse=True)
