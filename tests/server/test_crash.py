"""The real server is killed; nothing that was shown as done is missing afterwards."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.session import Session
from tests.server.helpers import Browser, announcement, part
from tests.server.served import Served, sees, served, texts, until, widget
from tests.session.helpers import good_csv

JOB = 90.0
"""s for a worker to be warm and a small job to end, on a busy machine."""
UPLOAD = "Upload a recording or a scenario"


@pytest.fixture
def recording(tmp_path: Path) -> bytes:
    folder = tmp_path / "made"
    folder.mkdir()
    session = Session("maker", folder)
    content = good_csv(session)
    session.close()
    return content


def upload(browser: Browser, name: str, content: bytes) -> None:
    start = announcement(widget(browser, UPLOAD), len(content), 1, name)
    browser.send(start)
    browser.send(part(start, 0, content))


def press(browser: Browser, label: str, value: object = True) -> None:
    browser.set(widget(browser, label, "GuiButton"), value)


def back(server: Served, storage: dict[str, str]) -> Browser:
    """The same browser, which takes its work up again."""
    browser = server.browser(storage=storage)
    browser.__enter__()
    sees(browser, "Restore your work of", JOB)
    press(browser, "Restore it")
    sees(browser, "is here again", JOB)
    return browser


def test_upload_edit_and_fit_survive_a_kill(tmp_path: Path, recording: bytes) -> None:
    storage: dict[str, str] = {}
    with served(tmp_path, "--workers", "1") as server, server.browser(storage=storage) as browser:
        browser.set(widget(browser, "Population"), 8)
        browser.set(widget(browser, "Generations"), 4)
        press(browser, "Stage", "Data")
        sees(browser, "7 to fit", JOB)
        upload(browser, "own.csv", recording)
        sees(browser, "own.csv: 3000 samples", JOB)
        press(browser, "Use it alone")
        sees(browser, "1 to fit", JOB)
        press(browser, "Stage", "Identify")
        press(browser, "Start identification")
        sees(browser, "EI (follows)", JOB)
        server.process.kill()
        server.process.wait()
    with served(tmp_path, "--workers", "1") as server:
        browser = back(server, storage)
        press(browser, "Stage", "Identify")
        sees(browser, "EI (follows)", JOB)
        press(browser, "Stage", "Data")
        sees(browser, "own.csv", JOB)
        assert "Traceback" not in server.log, server.log
        browser.__exit__(None, None, None)
        assert until(lambda: server.alive, JOB) and "damaged" not in texts(browser)
