"""The real server process under what it is not to accept."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.exceptions import InvalidStatus

from tests.server.helpers import Browser, announcement, part
from tests.server.served import PIECE, UPLOAD, Served, press, sees, served, show, until, widget

GIGA = 10**9
WRONG = (float("nan"), float("inf"), 1e9, -1e9, "100", None, True, [100.0], {"a": 1}, b"100")
JOB = 60.0
"""s for a worker to be warm, or to end a small job, on a busy machine."""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("safety"), "--workers", "1") as found:
        yield found


def angles(browser: Browser) -> list[str]:
    """What was written beside the second joint, oldest first."""
    found = [m.get("updates", m.get("props", {})).get("text", "") for m in browser.heard]
    return [text for text in found if isinstance(text, str) and text.startswith("θ₂")]


def moved(browser: Browser, degrees: float) -> None:
    """The session still does what it is told."""
    browser.set(widget(browser, "θ2 [deg]"), degrees)
    text = f"θ₂ = {degrees:.1f}°"
    until(lambda: browser.listen() and text in angles(browser), JOB, text)


def test_a_foreign_page_is_refused(server: Served) -> None:
    with pytest.raises(InvalidStatus) as refused, server.browser(origin="http://evil.example"):
        pass
    assert refused.value.response.status_code == 403
    assert server.alive


@pytest.mark.long
def test_a_wrong_join_code_is_refused(tmp_path: Path) -> None:
    options = ("--lan", "--host", "127.0.0.1", "--join-code", "ROBOT-ARM", "--workers", "1")
    with served(tmp_path, *options) as locked:
        for path in ("/", "/?code=ROBOT-LEG"):
            with pytest.raises(InvalidStatus) as refused, locked.browser(path=path):
                pass
            assert refused.value.response.status_code == 403
        with locked.browser(path="/?code=robotarm") as welcome:
            assert widget(welcome, "θ2 [deg]")


def test_wrong_values_change_nothing_and_end_nothing(server: Served) -> None:
    with server.browser() as browser:
        moved(browser, 90.0)
        told = len(angles(browser))
        for label in ("θ2 [deg]", "ε [GPa]", "Generations", "Action", "Method", "Refine"):
            uuid = widget(browser, label)
            for value in WRONG:
                if not (label == "Refine" and value is True):
                    browser.set(uuid, value)
            browser.set(uuid, 1.0, removed=True)
        browser.send_raw(b"\xc1 nonsense")
        browser.send_raw("text")
        moved(browser, 91.0)
        assert angles(browser)[told:] == ["θ₂ = 91.0°"]
    assert server.alive and "Traceback" not in server.log, server.log


def test_a_gigabyte_is_refused_before_it_comes(server: Served) -> None:
    with server.browser() as browser:
        uuid = widget(browser, UPLOAD)
        start = announcement(uuid, GIGA, GIGA // PIECE + 1, "huge.csv")
        browser.send(start)
        until(lambda: browser.listen() and browser.notes, JOB, "a refusal")
        assert "huge.csv has 1,000 MB; a file may have 100 MB" in " ".join(browser.notes)
        before = server.memory[0]
        for k in range(20):
            browser.send(part(start, k, bytes(PIECE)))
        moved(browser, 92.0)
        assert server.memory[0] - before < GIGA / 1e6 / 20
    assert server.alive


@pytest.mark.long
def test_a_killed_worker_is_replaced_and_its_job_starts_again(server: Served) -> None:
    with server.browser() as browser:
        show(browser, "Identify")
        browser.set(widget(browser, "Population"), 100)
        browser.set(widget(browser, "Generations"), 10_000)
        sees(browser, "7 recordings to fit", JOB)
        press(browser, "Start identification")
        sees(browser, "Identifying ", JOB)
        (victim,) = server.workers
        os.kill(victim, signal.SIGKILL)
        sees(browser, "was lost with its worker process (signal 9); start it again.", JOB)
        browser.set(widget(browser, "Population"), 8)
        browser.set(widget(browser, "Generations"), 4)
        press(browser, "Start identification")
        sees(browser, "EI (follows)", JOB)
        assert server.workers and victim not in server.workers
    assert server.alive and "Traceback" not in server.log, server.log
