"""Servers on loopback, with dummies for what belongs to others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from flexgui.page import page as page_module
from flexgui.server import app, sessions, tickets, work_folders
from flexgui.server.app import PageServer, Settings
from flexgui.server.options import bind
from flexgui.server.services import Limits
from tests.server.helpers import Browser, FakeClock, Pages, Shown, Thing

SMALL = Limits(upload_bytes=100_000, session_bytes=150_000, key_wait=1.0, key_wait_longer=1.0)


@dataclass
class Place:
    """A server and what can be seen of it."""

    server: PageServer
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
def make_place(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[MakePlace]:
    """Makes servers whose pages do as little as they can, and ends them."""
    monkeypatch.setenv(work_folders.STATE_VARIABLE, str(tmp_path / "state"))
    monkeypatch.setattr(app, "welcome", lambda client: None)
    made: list[PageServer] = []

    def make(limits: Limits = SMALL, **more: Any) -> Place:
        pages, clock = Pages(), FakeClock()
        monkeypatch.setattr(page_module, "build_page", pages)
        for module in (sessions, tickets):
            monkeypatch.setattr(module, "monotonic", clock)
        settings = Settings(make_session=Thing, limits=limits, **more)
        made.append(PageServer(bind("127.0.0.1", 0, 1), settings))
        return Place(made[-1], pages, clock)

    yield make
    for server in made:
        server.close()


@pytest.fixture
def place(make_place: MakePlace) -> Place:
    return make_place()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> FakeClock:
    """What sessions go by."""
    found = FakeClock()
    monkeypatch.setattr(sessions, "monotonic", found)
    return found
