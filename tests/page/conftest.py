"""A page in a real browser, on a viser server of its own; skipped where there is no Chromium."""

from __future__ import annotations

import sys
import threading
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import viser

from flexgui.jobs import JobPool
from flexgui.page.page import Page, build_page
from flexgui.server.services import Services
from flexgui.session.session import Session
from tests.page.helpers import FIRST, PATIENCE, SIZE
from tests.session.conftest import offered

FORGET = """() => {
  localStorage.clear();
  sessionStorage.clear();
  for (const plot of document.querySelectorAll('.uplot, .js-plotly-plot')) plot.dataset.before = '';
}"""
FIRST_ANEW = """document.querySelectorAll('.uplot:not([data-before])').length >= 2
  && document.querySelectorAll('.js-plotly-plot:not([data-before])').length >= 1
  && document.querySelectorAll('[data-before]').length === 0"""
"""The plots of the first stage stand, and none from before."""


class Desktop:
    """One server whose next browser gets `session`."""

    def __init__(self, services: Services) -> None:
        self.services = services
        self.session: Session | None = None
        self.read_only = False
        self.pages: list[Page] = []
        self._by_client: dict[int, Page] = {}
        self.server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        self.server.on_client_connect(self._connected)
        self.server.on_client_disconnect(self._gone)

    def _connected(self, client: viser.ClientHandle) -> None:
        assert self.session is not None
        page = build_page(client, self.session, self.read_only)
        self.pages.append(page)
        self._by_client[client.client_id] = page

    def _gone(self, client: viser.ClientHandle) -> None:
        self._by_client.pop(client.client_id).close()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server.get_port()}"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: Any) -> Iterator[Any]:
    """A failure shows what session and threads were at: a page that waits says nothing itself."""
    report = yield
    known = getattr(item, "funcargs", {})
    if report.failed and report.when == "call" and "session" in known:
        session: Session = known["session"]
        state = f"{session.stage}\n{session.message}\n{session.run.state}\nbusy: {session.run.busy}"
        report.sections.append(("session", state))
        report.sections.append(("threads", "\n".join(_threads())))
    return report


def _threads() -> Iterator[str]:
    """Where each of them is."""
    names = {one.ident: one.name for one in threading.enumerate()}
    for ident, frame in sys._current_frames().items():
        where = "".join(traceback.format_stack(frame)[-INNERMOST:])
        yield f"{names.get(ident, ident)}\n{where}"


INNERMOST = 4
"""Of a thread's calls: there are dozens of threads."""


@pytest.fixture(scope="session")
def desktop(chromium: Any, job_pool: JobPool) -> Iterator[Desktop]:
    made = Desktop(offered(job_pool))
    yield made
    made.server.stop()


@pytest.fixture
def session(desktop: Desktop, tmp_path: Path) -> Iterator[Session]:
    folder = tmp_path / "own"
    folder.mkdir()
    made = desktop.session = Session(str(tmp_path), folder, desktop.services)
    yield made
    for page in desktop.pages:
        page.close()
    desktop.pages.clear()
    desktop.read_only = False
    made.close()


@pytest.fixture(scope="module")
def tab(desktop: Desktop, chromium: Any) -> Iterator[Any]:
    """One for the tests of a file: two thirds of what a page costs is its scripts, read again."""
    context = chromium.new_context(viewport=SIZE, accept_downloads=True)
    context.set_default_timeout(PATIENCE)
    yield context.new_page()
    context.close()


@pytest.fixture
def page(desktop: Desktop, tab: Any, session: Session) -> Any:
    """The browser's page once the first plots stand: a person's who was never here.

    A test that replaces what the page's scripts stand on leaves it at about:blank.
    """
    if tab.url == "about:blank":
        tab.goto(desktop.address)
        tab.wait_for_function(FIRST)
        return tab
    tab.set_viewport_size(SIZE)
    tab.emulate_media(reduced_motion="null", color_scheme="null")
    tab.mouse.move(0, 0)
    tab.evaluate(FORGET)
    # It comes back by itself, as after every lost connection, and is built anew from the session.
    desktop.server._websock_server.disconnect_all_clients()
    tab.wait_for_function(FIRST_ANEW)
    return tab
