"""Settings for all tests."""

import shutil
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import settings

# The first call compiles, which no deadline per example allows for; the same examples each time.
settings.register_profile("flexgui", deadline=None, derandomize=True)
settings.load_profile("flexgui")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync "
    "--use-angle=swiftshader --enable-unsafe-swiftshader"
).split()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """One browser for all tests of a process: its driver cannot be started twice."""
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine: the page is not looked at")
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()
