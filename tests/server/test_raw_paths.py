"""Raw messages that try to read files of the server, of a follower with a copy of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from flexgui.server.app import PageServer, Settings
from flexgui.server.demo import COPY
from flexgui.server.options import bind
from flexgui.session.session import Session
from tests.server.helpers import Browser, action
from tests.server.served import stands, until, upload, widget
from tests.session.elsewhere import SECRET, names, secret, stated
from tests.session.helpers import alone

PATIENCE = 20.0
"""s for a page, on a busy machine."""
LONGEST = 900
"""Characters of a file's name that pass the guard."""


@pytest.fixture
def sessions() -> list[Session]:
    return []


@pytest.fixture
def server(sessions: list[Session]) -> Iterator[PageServer]:
    def make(key: str, folder: Path) -> Session:
        sessions.append(alone(key, folder))
        return sessions[-1]

    settings = Settings(make_session=make, demo=True)
    made = PageServer(bind("127.0.0.1", 0, 1), settings)
    yield made
    made.close()


@pytest.mark.long
def test_nothing_of_the_server_reaches_a_browser(
    server: PageServer, sessions: list[Session], tmp_path: Path
) -> None:
    hidden = secret(tmp_path)
    with Browser(server) as teacher:
        stands(teacher)
        with Browser(server) as browser:
            own = own_copy(browser, sessions)
            files = names(own.folder, hidden)
            for file in files:
                tried(browser, own, "it.toml", file)
            for name in files[::4]:
                tried(browser, own, name[:LONGEST], "th1.csv")
            browser.listen(1.0)
            assert own.wait_idle()
            heard = repr(browser.heard)
    assert "FileTransferPart" in heard, "the scenario was never downloaded"
    assert SECRET not in heard and str(own.folder) not in heard
    assert "root:x:" not in heard


def own_copy(browser: Browser, sessions: list[Session]) -> Session:
    """Of a follower, whose page may be built anew once the teacher's stands."""
    stands(browser)

    def copied() -> bool:
        browser.listen(0.5)
        before = browser.heard.copy()
        (*_, copy) = [m for m in before if m.get("props", {}).get("label") == COPY]
        browser.heard.clear()  # the teacher's widgets will be gone
        browser.set(copy["uuid"], True)
        browser.listen(0.5)
        if len(sessions) == 1:
            browser.heard[:0] = before
        return len(sessions) == 2

    until(copied, PATIENCE, "a copy")
    stands(browser)
    return sessions[-1]


def tried(browser: Browser, own: Session, name: str, file: str) -> None:
    """Uploads under a name a scenario that names a file, and takes the scenario away."""
    number = own.message.number
    upload(browser, name, stated(file).encode())

    def answered() -> bool:
        browser.listen(0.02)
        return own.message.number > number

    until(answered, PATIENCE, f"an answer to {name[:40]!r}, {file[:40]!r}")
    browser.set(widget(browser, "Action"), action("export", "Scenario file"))
