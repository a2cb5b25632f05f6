"""The real server is killed; nothing that was shown as done is missing afterwards."""

from __future__ import annotations

import time
from pathlib import Path
from random import Random

import pytest

from core.scenario.write import scenario_toml
from flexgui.session import Session
from flexgui.session.edit import Document, put
from tests.server.helpers import Browser, announcement, part
from tests.server.served import Served, sees, served, texts, until, widget
from tests.session.helpers import good_csv

JOB = 90.0
"""s for a worker to be warm and a small job to end, on a busy machine."""
SLOW = 600.0
"""s: a first and a second look at a model on a machine that does other things too."""
UPLOAD = "Upload a recording or a scenario"
FRICTION = "Add Coulomb friction"


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


def add(browser: Browser) -> None:
    """Adds what stands in the list, once its button can be pressed."""

    def ready() -> str | None:
        browser.listen()
        found: str | None = None
        disabled: dict[str, bool] = {}
        for message in browser.heard:
            props = message.get("updates", message.get("props", {}))
            if props.get("label") == FRICTION:
                found = message["uuid"]
            if "disabled" in props:
                disabled[message["uuid"]] = props["disabled"]
        return None if found is None or disabled.get(found) else found

    browser.set(until(ready, SLOW, FRICTION), True)


def back(server: Served, storage: dict[str, str]) -> Browser:
    """The same browser, which takes its work up again."""
    browser = server.browser(storage=storage)
    browser.__enter__()
    sees(browser, "Restore your work of", JOB)
    press(browser, "Restore it")
    sees(browser, "is restored", JOB)
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


@pytest.fixture
def hidden(tmp_path: Path) -> bytes:
    """Two short recordings with hidden friction, and two candidates."""

    def edit(document: Document) -> None:
        document["recordings"] = document["recordings"][:2]
        for entry in document["recordings"]:
            entry["simulate"]["seconds"] = 1.0

    folder = tmp_path / "made"
    folder.mkdir()
    session = Session("maker", folder)
    assert session.choose("something hidden", None)  # type: ignore[arg-type]
    kinds = put(("diagnose", "candidates"), ["coulomb_friction", "tip_payload"])
    assert session.change(edit, kinds)
    content = scenario_toml(session.scenario).encode()
    session.close()
    return content


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_diagnosis_and_what_was_added_survive_kills(
    tmp_path: Path, hidden: bytes, seed: int
) -> None:
    """Killed while it looks, while it adds, and as soon as the verdict on the addition is shown."""
    storage: dict[str, str] = {}
    random = Random(seed)

    def kill(server: Served, within: float) -> None:
        time.sleep(random.uniform(0.0, within))
        server.process.kill()
        server.process.wait()

    with served(tmp_path, "--workers", "1") as server, server.browser(storage=storage) as browser:
        sees(browser, "Seven working points", SLOW)
        press(browser, "Stage", "Data")
        upload(browser, "hidden.toml", hidden)
        sees(browser, "2 to fit", SLOW)
        press(browser, "Stage", "Diagnose")
        press(browser, "Find what is missing")
        kill(server, 8.0)
    with served(tmp_path, "--workers", "1") as server:
        browser = back(server, storage)
        press(browser, "Stage", "Diagnose")
        sees(browser, "2 recordings to diagnose.", SLOW)
        press(browser, "Find what is missing")
        sees(browser, "Something is missing.", SLOW)
        add(browser)
        kill(server, 8.0)
        browser.__exit__(None, None, None)
    with served(tmp_path, "--workers", "1") as server:
        browser = back(server, storage)
        press(browser, "Stage", "Diagnose")
        sees(browser, "Something is missing.", SLOW)
        if "In the model: Coulomb friction." not in texts(browser):  # killed before the click
            add(browser)
        else:
            press(browser, "Find what is missing")
        sees(browser, "Nothing is missing.", SLOW)
        server.process.kill()
        server.process.wait()
        browser.__exit__(None, None, None)
    with served(tmp_path, "--workers", "1") as server:
        browser = back(server, storage)
        press(browser, "Stage", "Diagnose")
        sees(browser, "Nothing is missing.", SLOW)
        sees(browser, "In the model: Coulomb friction.", SLOW)
        assert "Traceback" not in server.log and "damaged" not in texts(browser)
        browser.__exit__(None, None, None)
