"""Servers on loopback, with dummies for what belongs to others."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, cast

import pytest

from flexgui.jobs import JobPool
from flexgui.server.app import PageServer, Settings
from flexgui.server.limits import Limits
from flexgui.server.options import bind
from flexgui.server.services import Services
from tests.server.helpers import Browser, FakeClock, Pages, Shown, Thing, no_jobs

SMALL = Limits(upload_bytes=100_000, session_bytes=150_000, key_wait=1.0, key_wait_longer=1.0)


@dataclass
class Place:
    """A server and what can be seen of it."""

    server: PageServer[Thing]
    pages: Pages
    clock: FakeClock

    def page(self, browser: Browser) -> Shown:
        """Of a browser, once it is built: the newest with a widget that the browser knows."""

        def find() -> Shown | None:
            uuids = {m.get("uuid") for m in browser.heard}
            for shown in reversed(self.pages.all):
                if shown.widgets["upload"]._impl.uuid in uuids:
                    return shown
            return None

        found: Shown = browser.until(find, "the page")
        return found

    def set(self, browser: Browser, name: str, value: Any, **more: Any) -> None:
        browser.set(self.page(browser).widgets[name]._impl.uuid, value, **more)


MakePlace = Callable[..., Place]


@pytest.fixture
def make_place() -> Iterator[MakePlace]:
    """Makes servers, and ends them."""
    made: list[PageServer[Thing]] = []

    def make(limits: Limits = SMALL, **more: Any) -> Place:
        pages, clock = Pages(), FakeClock()
        log = logging.getLogger("flexgui.test")
        settings: Settings[Thing] = Settings(
            make_session=Thing,
            build_page=pages,
            services=Services(cast(JobPool, None), log=log),
            stop_jobs=no_jobs,
            limits=limits,
            clock=clock,
            **more,
        )
        made.append(PageServer(bind("127.0.0.1", 0, 1), settings))
        return Place(made[-1], pages, clock)

    yield make
    for server in made:
        server.close()


@pytest.fixture
def place(make_place: MakePlace) -> Place:
    return make_place()
