"""What streams for long is drawn more seldom; an edit never waits for it."""

from __future__ import annotations

import pytest

from flexgui.page import redraw
from flexgui.page.redraw import INTERVAL, LONG, SLOWEST, RedrawScheduler
from flexgui.session.state import Topic

BEGUN = 100.0
"""s on the clock."""


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [BEGUN]
    monkeypatch.setattr(redraw.time, "monotonic", lambda: now[0])
    return now


def pause_after(clock: list[float], seconds: float, *dirty: Topic) -> float:
    """s until the next drawing, after drawings twice each second for so long."""
    redraw = RedrawScheduler(lambda _: None, lambda: None, lambda: True)
    for k in range(int(2 * seconds) + 1):
        clock[0] = BEGUN + 0.5 * k
        redraw._paint([Topic.RUN])
    redraw.close()
    return max(redraw._pause(list(dirty)), 0.0)


def test_news_that_begin_are_drawn_four_times_each_second(clock: list[float]) -> None:
    assert pause_after(clock, 0.0, Topic.RUN) == pytest.approx(INTERVAL)


def test_the_longer_they_stream_the_more_seldom(clock: list[float]) -> None:
    assert pause_after(clock, LONG, Topic.RUN) == pytest.approx(2.0 * INTERVAL)
    assert pause_after(clock, 100.0 * LONG, Topic.RUN) == pytest.approx(SLOWEST)


def test_an_edit_waits_no_longer_than_at_first(clock: list[float]) -> None:
    assert pause_after(clock, 100.0 * LONG, Topic.RUN, Topic.SCENARIO) == pytest.approx(INTERVAL)


def test_what_does_not_stream_waits_for_nothing(clock: list[float]) -> None:
    assert pause_after(clock, 100.0 * LONG, Topic.RUN, Topic.STAGE) == 0.0
