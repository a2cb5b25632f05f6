"""Who comes and goes leaves nothing behind."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from flexgui.jobs.inbox import IDLE_SECONDS
from flexgui.server.app import PageServer, Settings
from flexgui.server.options import bind
from flexgui.server.services import Limits
from tests.server.helpers import Browser, FakeClock
from tests.server.served import stands, until
from tests.session.helpers import alone

pytestmark = pytest.mark.long

SOME = 8
"""Visits of a page with everything on it, which takes a second."""
PATIENCE = 20.0 + IDLE_SECONDS
POOLED = ("flexgui-callback", "flexgui-access", "asyncio_")
"""Threads that serve everybody and stay."""


def threads() -> list[str]:
    return [t.name for t in threading.enumerate() if not t.name.startswith(POOLED)]


def descriptors() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


def settled(server: PageServer, clock: FakeClock, before: tuple[int, int]) -> None:
    """Sessions, folders, threads and descriptors are as before, once the time has passed."""
    until(lambda: server.idle, PATIENCE, "the leave")

    def over() -> bool:
        clock.now += Limits.keep_untouched  # each leaves a moment after its browser
        return len(server.store) == 0

    until(over, PATIENCE, "the end of the sessions")
    until(lambda: not list(server.store.root.iterdir()), PATIENCE, "the end of the folders")
    until(lambda: len(threads()) <= before[0], PATIENCE, "the end of the threads")
    until(lambda: descriptors() <= before[1], PATIENCE, "the end of the descriptors")


@pytest.fixture
def real(clock: FakeClock) -> Iterator[PageServer]:
    settings = Settings(make_session=alone)
    made = PageServer(bind("127.0.0.1", 0, 1), settings)
    yield made
    made.close()


def test_visits_of_whole_pages_leave_nothing(real: PageServer, clock: FakeClock) -> None:
    def visit() -> None:
        with Browser(real) as browser:
            stands(browser)

    visit()
    until(lambda: real.idle, PATIENCE, "the leave")
    until(lambda: "flexgui-pool" not in threads(), PATIENCE, "the rest of the crew")
    before = (len(threads()), descriptors())
    for _ in range(SOME):
        visit()
    settled(real, clock, before)
