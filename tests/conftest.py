"""Settings for all tests."""

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from tests.compiled import compile_shared

if sys.dont_write_bytecode:
    # The tests start hundreds of processes, and each would compile every module of ours anew: a
    # second of a processor. The virtual environment is no place that this was to keep clean.
    sys.dont_write_bytecode = False
    sys.pycache_prefix = str(Path(sys.prefix) / "bytecode")
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# The first call compiles, which no deadline per example allows for; the same examples each time.
settings.register_profile("flexgui", deadline=None, derandomize=True)
settings.load_profile("flexgui")


def pytest_configure(config: pytest.Config) -> None:
    """Before xdist starts its workers, which would all compile the same at the same time."""
    if not hasattr(config, "workerinput") and config.getoption("numprocesses", None):
        compile_shared()


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync "
    "--use-angle=swiftshader --enable-unsafe-swiftshader"
).split()


@contextmanager
def headless_browser() -> Iterator[Any]:
    """Without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """One browser for all tests of a process: its driver cannot be started twice."""
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine: the page is not looked at")
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with headless_browser() as browser:
        yield browser


@pytest.fixture(scope="session")
def job_pool() -> Iterator[Any]:
    """One warm worker for the tests of pages and sessions: loading what jobs need takes seconds."""
    from flexgui.jobs import JobPool
    from tests.jobs.helpers import EVEN, warm_readers

    warm_readers()
    with JobPool(1, EVEN) as pool:
        yield pool
