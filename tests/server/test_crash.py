"""The real server is killed; nothing that was shown as done is missing afterwards."""

from __future__ import annotations

import time
from pathlib import Path
from random import Random

import pytest

from flexgui.core.scenario.read import scenario_toml
from flexgui.session.scenario_edits import set_value
from tests.server.helpers import Browser, action
from tests.server.served import Served, press, sees, served, show, texts, until, upload, widget
from tests.session.helpers import alone, good_csv, shortened

pytestmark = pytest.mark.long

JOB = 90.0
"""s for a worker to be warm and a small job to end, on a busy machine."""
SLOW = 600.0
"""s: a first and a second look at a model on a machine that does other things too."""
ADD = "data-action='add effect'"
FRICTION = f"{ADD} data-value='coulomb_friction' title=''>"
UNJUDGED, MISSING = "2 recordings to diagnose.", "Something is missing."
ADDED, NOTHING = "In the model: Coulomb friction.", "Nothing is missing."
STEPS = (UNJUDGED, MISSING, ADDED, NOTHING)
WITHIN = 8.0
"""s of which one moment is hit at random: a look takes three on a fast machine and a minute on a
busy one, so that some kills come in the middle of it and some after it."""


@pytest.fixture
def recording(tmp_path: Path) -> bytes:
    session = alone("maker", tmp_path / "made")
    content = good_csv(session)
    session.close()
    return content


def addable(browser: Browser) -> bool:
    """Whether the newest list has a button that adds friction and can be pressed."""
    told = [m.get("updates", m.get("props", {})).get("content", "") for m in browser.heard]
    lists = [content for content in told if ADD in str(content)]
    return bool(lists) and FRICTION in lists[-1]


def add(browser: Browser) -> None:
    """Adds what stands in the list, once its button can be pressed."""
    until(lambda: browser.listen() and addable(browser), SLOW, FRICTION)
    browser.set(widget(browser, "Action"), action("add effect", "coulomb_friction"))


def reached(browser: Browser) -> int:
    """How far the work has come by what was shown: the last of STEPS."""
    said = texts(browser)
    return max((k for k, step in enumerate(STEPS) if step in said), default=0)


def taken_up(browser: Browser) -> int:
    """The same of a page that has just come back, once all that it tells is heard.

    It says what is in the model after the verdict, and offers what can be added last. How far the
    work was when it was killed is a matter of the machine's speed: any step may be the last one.
    """

    def known() -> bool:
        browser.listen()
        said = texts(browser)
        return any(step in said for step in (UNJUDGED, ADDED, NOTHING)) or addable(browser)

    until(known, JOB, "what was found before")
    return reached(browser)


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


@pytest.fixture
def hidden(tmp_path: Path) -> bytes:
    """Two short recordings with hidden friction, and two candidates."""
    session = alone("maker", tmp_path / "made")
    assert session.choose("something hidden")
    kinds = set_value(("diagnose", "candidates"), ["coulomb_friction", "tip_payload"])
    assert session.document.change(shortened(0, 1), kinds)
    content = scenario_toml(session.document.scenario).encode()
    session.close()
    return content


def killed(server: Served, browser: Browser, moment: float) -> int:
    """Kills it after `moment` s, in which the page is followed; how far that was shown to be."""
    end = time.monotonic() + moment
    while time.monotonic() < end:
        browser.listen()
    server.process.kill()
    server.process.wait()
    browser.__exit__(None, None, None)
    return reached(browser)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_diagnosis_and_what_was_added_survive_kills(
    tmp_path: Path, hidden: bytes, seed: int
) -> None:
    """Killed after it begins to look, after it is to add, and as soon as the verdict on the
    addition is shown: what a page has shown, the next one shows."""
    storage: dict[str, str] = {}
    random = Random(seed)
    with served(tmp_path, "--workers", "1") as server:
        browser = server.browser(storage=storage)
        browser.__enter__()
        sees(browser, "Seven working points", SLOW)
        show(browser, "Data")
        upload(browser, "hidden.toml", hidden)
        sees(browser, "2 to fit", SLOW)
        show(browser, "Diagnose")
        press(browser, "Find what is missing")
        shown = killed(server, browser, random.uniform(0.0, WITHIN))
    with served(tmp_path, "--workers", "1") as server:
        browser = back(server, storage)
        show(browser, "Diagnose")
        assert (now := taken_up(browser)) >= shown
        if STEPS[now] == UNJUDGED:
            press(browser, "Find what is missing")
        sees(browser, MISSING, SLOW)
        add(browser)
        shown = killed(server, browser, random.uniform(0.0, WITHIN))
    with served(tmp_path, "--workers", "1") as server:
        browser = back(server, storage)
        show(browser, "Diagnose")
        assert (now := taken_up(browser)) >= shown
        if STEPS[now] == MISSING:
            add(browser)
        elif STEPS[now] == ADDED:
            press(browser, "Find what is missing")
        sees(browser, NOTHING, SLOW)
        killed(server, browser, 0.0)
    with served(tmp_path, "--workers", "1") as server:
        browser = back(server, storage)
        show(browser, "Diagnose")
        sees(browser, NOTHING, JOB)
        sees(browser, ADDED, JOB)
        assert "Traceback" not in server.log and "damaged" not in texts(browser)
        browser.__exit__(None, None, None)
