"""The real server process under what it is not to accept, and after it was killed."""

from __future__ import annotations

from pathlib import Path

import pytest
from websockets.exceptions import InvalidStatus

from tests.server.helpers import Browser
from tests.server.served import Served, press, sees, served, show, texts, until, upload, widget
from tests.session.helpers import alone, good_csv

JOB = 90.0
"""s for a worker to be warm and a small job to end, on a busy machine."""
WRONG = (float("nan"), float("inf"), 1e9, -1e9, "100", None, True, [100.0], {"a": 1}, b"100")


def angles(browser: Browser) -> list[str]:
    """What was written beside the second joint, oldest first."""
    found = [m.get("updates", m.get("props", {})).get("text", "") for m in browser.heard]
    return [text for text in found if isinstance(text, str) and text.startswith("θ₂")]


def moved(browser: Browser, degrees: float) -> None:
    """The session still does what it is told."""
    browser.set(widget(browser, "θ2 [deg]"), degrees)
    text = f"θ₂ = {degrees:.1f}°"
    until(lambda: browser.listen() and text in angles(browser), JOB, text)


def test_wrong_values_change_nothing_and_end_nothing(tmp_path: Path) -> None:
    with served(tmp_path, "--workers", "1") as server, server.browser() as browser:
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


@pytest.mark.long
def test_a_class_on_the_network_is_shown_a_code_and_nobody_comes_in_with_another(
    tmp_path: Path,
) -> None:
    options = ("--lan", "--host", "127.0.0.1", "--join-code", "ROBOT-ARM", "--workers", "1")
    with served(tmp_path, *options) as locked:
        assert "Join code: ROBOT-ARM" in locked.terminal
        for path in ("/", "/?code=ROBOT-LEG"):
            with pytest.raises(InvalidStatus) as refused, locked.browser(path=path):
                pass
            assert refused.value.response.status_code == 403
        with locked.browser(path="/?code=robotarm") as welcome:
            assert widget(welcome, "θ2 [deg]")


def back(server: Served, storage: dict[str, str]) -> Browser:
    """The same browser, which takes its work up again."""
    browser = server.browser(storage=storage)
    browser.__enter__()
    sees(browser, "Restore your work of", JOB)
    press(browser, "Restore it")
    sees(browser, "is restored", JOB)
    return browser


@pytest.mark.long
def test_upload_edit_and_fit_survive_a_kill(tmp_path: Path) -> None:
    storage: dict[str, str] = {}
    maker = alone("maker", tmp_path / "made")
    recording = good_csv(maker)
    maker.close()
    with served(tmp_path, "--workers", "1") as server, server.browser(storage=storage) as browser:
        browser.set(widget(browser, "Population"), 8)
        browser.set(widget(browser, "Generations"), 4)
        show(browser, "Data")
        sees(browser, "7 to fit", JOB)
        upload(browser, "own.csv", recording)
        sees(browser, "own.csv: 3000 samples", JOB)
        sees(browser, "1 to fit", JOB)
        show(browser, "Identify")
        press(browser, "Start identification")
        sees(browser, "Converged: yes", JOB)
        server.process.kill()
        server.process.wait()
    with served(tmp_path, "--workers", "1") as server:
        browser = back(server, storage)
        show(browser, "Identify")
        sees(browser, "Converged: yes", JOB)
        show(browser, "Data")
        sees(browser, "own.csv", JOB)
        assert "Traceback" not in server.log, server.log
        browser.__exit__(None, None, None)
        assert until(lambda: server.alive, JOB) and "damaged" not in texts(browser)
