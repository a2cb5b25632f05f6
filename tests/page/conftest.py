"""A page in a real browser, on a viser server of its own; skipped where there is no Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import viser

from flexgui.jobs import JobPool
from flexgui.page import Page, build_page
from flexgui.session import Session
from flexgui.session.board import Board
from tests.jobs.helpers import EVEN, warm_readers
from tests.page.helpers import FIRST

UPLOAD_LIMIT = 1_000_000
PATIENCE = 30_000
"""ms that a click or a sentence may take on a busy machine without a graphics card."""


@dataclass(frozen=True)
class Offered:
    """What the server offers."""

    pool: JobPool
    data_folder: Path | None = None
    upload_limit_bytes: int = UPLOAD_LIMIT
    board: Board = field(default_factory=Board)


class Desktop:
    """One server whose next browser gets `session`."""

    def __init__(self, services: Offered) -> None:
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
        page = build_page(client, self.session, self.services, self.read_only)
        self.pages.append(page)
        self._by_client[client.client_id] = page

    def _gone(self, client: viser.ClientHandle) -> None:
        self._by_client.pop(client.client_id).close()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server.get_port()}"


@pytest.fixture(scope="session")
def desktop(chromium: Any) -> Iterator[Desktop]:
    warm_readers()
    with JobPool(1, EVEN) as pool:
        made = Desktop(Offered(pool))
        yield made
        made.server.stop()


@pytest.fixture
def session(desktop: Desktop, tmp_path: Path) -> Iterator[Session]:
    folder = tmp_path / "own"
    folder.mkdir()
    made = desktop.session = Session(str(tmp_path), folder)
    yield made
    for page in desktop.pages:
        page.close()
    desktop.pages.clear()
    desktop.read_only = False
    made.close()


@pytest.fixture
def page(desktop: Desktop, chromium: Any, session: Session) -> Iterator[Any]:
    """The browser's page once the first plots stand."""
    context = chromium.new_context(viewport={"width": 1600, "height": 900}, accept_downloads=True)
    context.set_default_timeout(PATIENCE)
    opened = context.new_page()
    opened.goto(desktop.address)
    opened.wait_for_function(FIRST)
    yield opened
    context.close()
